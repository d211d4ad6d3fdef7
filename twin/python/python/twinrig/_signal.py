"""Signals: arrays of samples with name, unit and times."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from twinrig._html import table

Floats = npt.NDArray[np.float64]


class Signal(np.ndarray[Any, np.dtype[np.float64]]):
    """Samples of a signal: float64, of shape (n,), or (n, size) for a vector.

    The array is a view of the matrix of its group, without a copy. Views that select samples or
    components (``signal[10:20]``, ``signal[mask]``, ``signal[:, 2]``) keep `name`, `unit` and the
    matching `time`; results of arithmetic are ordinary arrays.
    """

    _name: str
    _unit: str
    _time: Floats | None

    def __new__(cls, values: Floats, name: str, unit: str, time: Floats) -> Signal:
        signal = np.asarray(values).view(cls)
        signal._name, signal._unit, signal._time = name, unit, time
        return signal

    def __array_finalize__(self, of: object) -> None:
        self._name = getattr(of, "_name", "")
        self._unit = getattr(of, "_unit", "")
        # Which samples an unknown view has is not known; `__getitem__` sets it for those it makes.
        self._time = None

    @property
    def name(self) -> str:
        """Path of the signal: ``leg/LF/hip/position``."""
        return self._name

    @property
    def unit(self) -> str:
        """Symbol of the unit: ``rad``; ``1`` for numbers without one."""
        return self._unit

    @property
    def time(self) -> Floats:
        """Simulated time of each sample [s], of shape (n,)."""
        if self._time is None:
            raise AttributeError(
                "this array has no times any more: it is neither a signal of a run nor a selection "
                "of its samples"
            )
        return self._time

    def __getitem__(self, index: Any) -> Any:
        found = super().__getitem__(index)
        if not isinstance(found, Signal):
            return found
        rows = _rows(index, self.ndim)
        time = None if self._time is None or rows is None else _selected(self._time, rows)
        if time is not None and time.ndim == 1 and found.shape[:1] == time.shape:
            found._time = time
            return found
        # Not a series any more: one sample of a vector, say.
        return found.view(np.ndarray)

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: Any, *inputs: Any, **options: Any
    ) -> Any:
        def plain(value: Any) -> Any:
            return value.view(np.ndarray) if isinstance(value, Signal) else value

        if "out" in options:
            options["out"] = tuple(plain(out) for out in options["out"])
        return getattr(ufunc, method)(*(plain(value) for value in inputs), **options)

    def sort(self, *arguments: Any, **options: Any) -> None:
        """Sort in place, after which the samples have no times."""
        self._time = None
        super().sort(*arguments, **options)

    def partition(self, *arguments: Any, **options: Any) -> None:
        """Partition in place, after which the samples have no times."""
        self._time = None
        super().partition(*arguments, **options)

    def copy(self, order: Any = "C") -> Signal:
        """Return a copy with the same name, unit and times."""
        copied = super().copy(order).view(Signal)
        copied._name, copied._unit, copied._time = self._name, self._unit, self._time
        return copied

    def __reduce__(self) -> Any:
        return _restored, (np.asarray(self).copy(), self._name, self._unit, self._time)

    def __repr__(self) -> str:
        return f"<Signal {self._name!r} [{self._unit}], {np.asarray(self)!r}>"

    def _repr_html_(self) -> str:
        # A view may have any shape: each sample is a row.
        shape = self.shape or (1,)
        values = np.asarray(self).reshape(shape[0], int(np.prod(shape[1:])))
        rows = []
        if values.size:
            ends = ("first", values[0]), ("last", values[-1])
            limits = ("least", values.min(axis=0)), ("greatest", values.max(axis=0))
            rows = [(name, *row.tolist()) for name, row in (*ends, *limits)]
        parts = [part.strip() or "value" for part in _parts_of(values.shape[1])]
        return table(f"{self._name} [{self._unit}]: {shape[0]} samples", ("", *parts), rows)


def _rows(index: Any, dimensions: int) -> Any:
    """Return the part of an index that selects samples; ``None`` if its first axis is a new one."""
    parts = index if isinstance(index, tuple) else (index,)
    if not parts:
        return slice(None)
    if parts[0] is not Ellipsis:
        return parts[0]
    # The Ellipsis stands for the samples, unless the other parts have all axes.
    return slice(None) if sum(map(_axes, parts[1:])) < max(dimensions, 1) else parts[1]


def _axes(part: Any) -> int:
    """Return the number of axes that a part of an index selects from."""
    if part is None:
        return 0
    is_mask = not isinstance(part, slice) and np.asarray(part).dtype == np.bool_
    return np.ndim(part) if is_mask else 1


def _selected(time: Floats, rows: Any) -> Floats | None:
    try:
        return np.asarray(time[rows])
    except (IndexError, TypeError):
        # A mask over samples and components, say.
        return None


def _restored(values: Floats, name: str, unit: str, time: Floats | None) -> Signal:
    signal = values.view(Signal)
    signal._name, signal._unit, signal._time = name, unit, time
    return signal


def frozen(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the array without leave to write: what a fingerprint is of must not change."""
    array.flags.writeable = False
    return array


class SignalGroup(Mapping[str, Signal]):
    """Signals that are sampled together, by name, in the order of the recording.

    Arrays are read-only; ``signal.copy()`` is not.
    """

    name: str
    """``plant``, ``process-inputs``, ``process-outputs`` or ``gauges`` (counters)."""
    time: Floats
    """Time of each sample [s], of shape (n,)."""
    matrix: Floats
    """All samples, of shape (n, width): the columns are the components of the signals."""

    def __init__(
        self,
        name: str,
        rows: Sequence[tuple[str, str, int]],
        time: Floats,
        values: Floats,
    ) -> None:
        width = sum(size for _, _, size in rows)
        self.name, self.time = name, frozen(time)
        self.matrix = frozen(values.reshape(len(time), width))
        self._columns: dict[str, tuple[int, int, str]] = {}
        start = 0
        for signal, unit, size in rows:
            self._columns.setdefault(signal, (start, size, unit))
            start += size

    def __getitem__(self, name: str) -> Signal:
        column = self._columns.get(name) if isinstance(name, str) else None
        if column is None:
            unknown(name, self._columns)
        start, size, unit = column
        columns = start if size == 1 else slice(start, start + size)
        return Signal(self.matrix[:, columns], name, unit, self.time)

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def columns(self) -> dict[str, Floats]:
        """Return the components of all signals, each of shape (n,).

        The name of a component of a vector has its letter (x, y, z) or number behind it:
        ``body/position x``.
        """
        found: dict[str, Floats] = {}
        for name, (start, size, _) in self._columns.items():
            parts = _parts_of(size)
            found |= {name + part: self.matrix[:, start + i] for i, part in enumerate(parts)}
        return found

    def to_pandas(self) -> Any:
        """Return a ``pandas.DataFrame`` of `columns`, with the time [s] as its index."""
        import pandas

        return pandas.DataFrame(self.columns(), index=pandas.Index(self.time, name="time"))

    def to_xarray(self) -> Any:
        """Return an ``xarray.Dataset`` of the signals over `time`, with their units."""
        import xarray

        def variable(signal: Signal) -> Any:
            axes = ["time", *(f"component_{size}" for size in signal.shape[1:])]
            return axes, np.asarray(signal), {"units": signal.unit}

        variables = {name: variable(signal) for name, signal in self.items()}
        return xarray.Dataset(variables, coords={"time": ("time", self.time, {"units": "s"})})

    def __array__(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("signals have units and sizes of their own: `columns`, `to_pandas`, `matrix`")

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        frozen(self.time)
        frozen(self.matrix)

    def __repr__(self) -> str:
        return f"<SignalGroup {self.name!r}, {len(self)} signals, {len(self.time)} samples>"

    def _repr_html_(self) -> str:
        rows = ((name, size, unit) for name, (_, size, unit) in self._columns.items())
        caption = f"{self.name}: {len(self.time)} samples"
        return table(caption, ("signal", "size", "unit"), rows)


def _parts_of(size: int) -> Sequence[str]:
    """Return what is behind the name of a signal for each of its components."""
    if size == 1:
        return [""]
    return [" x", " y", " z"] if size == 3 else [f" {i}" for i in range(size)]


class Signals(Mapping[str, Signal]):
    """Signals of a run by name. A name in several groups is that of the plant.

    `groups` has the others: ``run.signals.groups["process-inputs"]["leg/LF/hip/position"]`` is the
    position as the controller read it.
    """

    groups: dict[str, SignalGroup]

    def __init__(self, groups: Sequence[SignalGroup]) -> None:
        self.groups = {group.name: group for group in groups}

    def __getitem__(self, name: str) -> Signal:
        for group in self.groups.values():
            if isinstance(name, str) and name in group:
                return group[name]
        unknown(name, self)

    def __iter__(self) -> Iterator[str]:
        names = (name for group in self.groups.values() for name in group)
        return iter(dict.fromkeys(names))

    def __len__(self) -> int:
        return len(set().union(*self.groups.values()))

    def columns(self) -> dict[str, Floats]:
        """Return the components of the plant's signals, as `SignalGroup.columns`."""
        return self._plant().columns()

    def to_pandas(self) -> Any:
        """Return the plant's signals, as `SignalGroup.to_pandas`."""
        return self._plant().to_pandas()

    def to_xarray(self) -> Any:
        """Return the plant's signals, as `SignalGroup.to_xarray`."""
        return self._plant().to_xarray()

    def _plant(self) -> SignalGroup:
        if "plant" not in self.groups:
            raise KeyError(f"no signal of the plant was kept; there are {', '.join(self.groups)}")
        return self.groups["plant"]

    def __array__(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("signals have units and sizes of their own: `columns`, `to_pandas`")

    def __repr__(self) -> str:
        return f"<Signals of {', '.join(self.groups) or 'no group'}: {len(self)}>"

    def _repr_html_(self) -> str:
        return "".join(group._repr_html_() for group in self.groups.values())


def unknown(name: object, known: Mapping[str, Any]) -> NoReturn:
    """Raise a KeyError with the known names next to `name`."""
    if not isinstance(name, str):
        raise KeyError(f"a name is a string, not {type(name).__name__}: {name!r}")
    near = difflib.get_close_matches(name, list(known), n=3)
    if near:
        help = "did you mean " + " or ".join(repr(one) for one in near) + "?"
    elif known:
        help = f"there are {len(known)} names, among them {next(iter(known))!r}"
    else:
        help = "there are none: `signals=` or [record] signals selects them"
    raise KeyError(f"there is no {name!r}; {help}")
