"""The documentation site: pages of the repository, and pages made from schemas, docstrings, robots and reports.

`make docs` runs ``python -m website``. Everything that Sphinx reads is gathered in ``build/site/source``, a tree of the
repository's own shape, so that links between pages are the same there as in a checkout.
"""
