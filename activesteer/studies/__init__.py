"""Many runs: the engine that makes them, linear analysis of the car, and the paper's studies."""
