"""What docs/build.py needs: sources of the pages, the reference, and Sphinx's hooks."""
