"""Linear algebra of collocation: stages, block elimination over the mesh, its backends; knows arrays only."""
