"""The two phases of the benchmark: free play, and the test on goals never seen."""
