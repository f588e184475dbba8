"""The head: mesh, identity, expressions, joints."""

from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.head.store import load_head, save_head

__all__ = ["HeadModel", "load_builtin_head", "load_head", "save_head"]
