"""Points where the equations are singular: kernels, extended systems, normal forms, rays."""
