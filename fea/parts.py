"""Parts that an experiment on one specimen may be put to."""

from fea.body import Body
from fea.shell import Shell

#: A specimen in elements; both have the same methods.
Deformable = Body | Shell
