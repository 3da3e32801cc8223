"""Random accepted scenes, solved by both solvers and checked from their archived output alone."""
