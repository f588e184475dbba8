"""The studio: takes that are seen, corrected and kept as project files.

project     NAME.elocute.json: sound, text, phones, edits, settings; read, checked, animated
folder      the projects of a folder, by names that are checked
work        what worker processes do: takes, exports, reports of characters
jobs        the workers: progress, cancelling, deadlines
session     a studio while it runs: folder, workers, cache, and pages that hear of them
server      what the page asks for
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.studio.project import Project as Project, open_project as open_project

__getattr__, __dir__ = lazy(__name__, __file__)
