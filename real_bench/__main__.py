"""``python -m real_bench``: the command ``realbench``."""

from real_bench.cli import main

if __name__ == "__main__":
    main()
