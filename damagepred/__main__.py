"""``python -m damagepred`` is the command ``damagepred``."""

from damagepred.cli import main

if __name__ == "__main__":
    main()
