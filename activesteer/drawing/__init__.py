"""Parts of cars for rerun, film and live view: bodies, wheel angles, tyre forces."""
