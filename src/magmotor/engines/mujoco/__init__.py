"""The MuJoCo engine: scenes as MJCF, the compiled magnetism callback, and the stepping loop."""
