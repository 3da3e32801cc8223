"""Arguments, files and text from users: checked, or refused in one sentence."""
