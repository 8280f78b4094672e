"""What is drawn of cars wherever they are shown, in rerun, film and live view: bodies, wheel angles, tyre forces."""
