"""Options of a command made of settings: one for each field of a dataclass.

    def voca_command(corpus: Path = ..., config: TrainConfig = options_of(TrainConfig)) -> None:

The command is called with a `TrainConfig` that was built, and so checked, of what was given.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, get_type_hints

import typer

from elocute.numerics.frame_rates import frame_rate
from elocute.settings import settings_of, types_of


class Group(Protocol):
    """Several options that arrive as one argument."""

    def options(self) -> dict[str, tuple[Any, Any]]:
        """Type and typer option of each, by the name of its parameter."""
        ...

    def build(self, given: dict[str, Any]) -> Any:
        """The argument, of the values given to `options`. Raises InputError."""
        ...


@dataclass(frozen=True)
class SettingsGroup:
    """The settings of a dataclass, but for those that the command takes otherwise."""

    cls: type
    without: frozenset[str]
    flags: Mapping[str, str]
    defaults: Mapping[str, Any]

    def options(self) -> dict[str, tuple[Any, Any]]:
        parameters: dict[str, tuple[Any, Any]] = {}
        for each, _ in settings_of(self.cls):
            if each.name in self.without:
                continue
            kind, optional = types_of(self.cls)[each.name]
            flags, default = self.flags.get(each.name, ""), self.defaults.get(each.name, ...)
            flag = option(self.cls, each.name, *([flags] if flags else []), default=default)
            parameters[each.name] = (kind | None if optional else kind, flag)
        return parameters

    def build(self, given: dict[str, Any]) -> Any:
        return self.cls(**given)


@dataclass(frozen=True)
class PresetGroup(SettingsGroup):
    """Settings that begin with a preset; every one that is given stands above it."""

    presets: tuple[str, ...]

    def options(self) -> dict[str, tuple[Any, Any]]:
        help = f"Settings to begin with ({', '.join(self.presets)}); other options change them."
        parameters: dict[str, tuple[Any, Any]] = {
            "preset": (str, typer.Option(self.presets[0], help=help))
        }
        for name, (kind, choice) in super().options().items():
            shown, choice.default = choice.default, None
            if isinstance(shown, bool):
                flag = name.replace("_", "-")
                both = choice.param_decls[0] if choice.param_decls else f"--{flag}/--no-{flag}"
                shown = both.split("/")[0 if shown else 1].lstrip("-")
            choice.help += f" [default: {shown}]"
            parameters[name] = (kind | None, choice)
        return parameters

    def build(self, given: dict[str, Any]) -> Any:
        changes = {name: value for name, value in given.items() if value is not None}
        return self.cls.preset(changes.pop("preset"), **changes)


def options_of(
    cls: type,
    *,
    without: Iterable[str] = (),
    flags: Mapping[str, str] | None = None,
    defaults: Mapping[str, Any] | None = None,
    presets: Iterable[str] = (),
) -> Any:
    """The default of a parameter that stands for the settings of a dataclass.

    `without` are fields that are not options. `flags` are those that are not named after their
    fields, as {"batch_pairs": "--batch"}, and `defaults` those that differ from the dataclass's.
    `presets` are names that the dataclass's method `preset` takes, its defaults first.
    """
    settings = (cls, frozenset(without), flags or {}, defaults or {})
    return PresetGroup(*settings, tuple(presets)) if presets else SettingsGroup(*settings)


def option(
    cls: type,
    name: str,
    *flags: str,
    default: Any = ...,
    completed: Callable[[], Iterable[str]] | None = None,
) -> Any:
    """The typer option of the field `name`; its range is checked where the setting is used.

    `flags` and `default` are given where they differ from the dataclass's; `completed` gives the
    names that a shell completes.
    """
    field, known = next(pair for pair in settings_of(cls) if pair[0].name == name)
    more: dict[str, Any] = {"parser": frame_rate, "metavar": "RATE"} if name == "fps" else {}
    if completed is not None:

        def complete(incomplete: str) -> list[str]:
            return [each for each in completed() if each.startswith(incomplete)]

        more["autocompletion"] = complete
    return typer.Option(
        field.default if default is ... else default, *flags, help=known.text, **more
    )


def expanded(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with the options of each Group in the place of its parameter."""
    signature = inspect.signature(function)
    groups: dict[str, Group] = {
        name: each.default
        for name, each in signature.parameters.items()
        if hasattr(each.default, "build")
    }
    if not groups:
        return function
    hints = get_type_hints(function)
    parameters = []
    for name, each in signature.parameters.items():
        inner_options = (
            groups[name].options() if name in groups else {name: (hints[name], each.default)}
        )
        parameters += [
            inspect.Parameter(
                inner, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind
            )
            for inner, (kind, default) in inner_options.items()
        ]

    @functools.wraps(function)
    def command(**given: Any) -> Any:
        for name, group in groups.items():
            given[name] = group.build({inner: given.pop(inner) for inner in group.options()})
        return function(**given)

    command.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {each.name: each.annotation for each in parameters}
    return command
