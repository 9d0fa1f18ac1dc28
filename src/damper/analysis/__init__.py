"""What a cube tells in numbers: cubes in, numbers out; for tables, figures and notebooks."""
