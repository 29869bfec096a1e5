"""Python package for programs that use the instrument. `pneuforce` contains its public names."""
