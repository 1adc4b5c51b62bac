"""The problem on a mesh: solutions, collocation equations, Newton's method, error estimates and meshes."""
