"""Many runs, or what is found out about a car by driving it."""
