"""Compiled mechanics: arrays in, arrays out. No input or output, no random numbers, no strings, no exceptions."""
