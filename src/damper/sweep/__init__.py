"""Many runs: points, continuation, slices, cubes, `simulate`."""
