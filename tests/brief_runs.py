"""A mark of tests in which bits and names of the records count, not their statistics."""

import pytest

BRIEF = pytest.mark.filterwarnings("ignore:.*the records still contain")
