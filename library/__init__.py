"""The library for programs without a compiler: what builds it, and its C part."""
