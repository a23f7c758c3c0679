"""The machine and its files: manipulator, TOML and CSV data, and the checks on arguments that all rooms share."""
