"""One study per published robot or swimmer, those of measuring, each scored against what is printed; the gallery."""

from .catalogue import StudyEntry, studies
from .study import Progress, Study

__all__ = ["STUDIES", "Progress", "Study", "StudyEntry"]

STUDIES = studies()
