"""Law of the contacts of a mortar joint."""
