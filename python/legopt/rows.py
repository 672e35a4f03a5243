"""Rows in plain Python, and on request in NumPy and pandas."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from .errors import MissingPackageError, RequestError, suggest

if TYPE_CHECKING:
    import pandas

# Names of Debian's packages; pip and conda use the import name.
_DEBIAN_PACKAGES = {"numpy": "python3-numpy", "pandas": "python3-pandas"}


def require(package: str, purpose: str) -> Any:
    """Returns the imported package. MissingPackageError if it is not installed; the message names Debian's package."""
    try:
        return importlib.import_module(package)
    except ImportError as error:
        debian = _DEBIAN_PACKAGES.get(package, "python3-" + package)
        raise MissingPackageError(f"{purpose} needs {package} ({error}); on Debian: apt install {debian}") from error


class Rows(list[dict[str, Any]]):
    """A list of dicts that all have the same keys, `columns`, in their order. As a list it is accepted by `json.dumps`,
    `sorted` and `csv.DictWriter`."""

    def __init__(self, columns: Sequence[str], rows: Iterable[dict[str, Any]] = ()):
        super().__init__(rows)
        self.columns = list(columns)

    def column(self, name: str) -> list[Any]:
        """Returns one column. RequestError if there is none of this name."""
        if name not in self.columns:
            raise RequestError(f"there is no column '{name}'; {suggest(name, self.columns)}")
        return [row[name] for row in self]

    def where(self, **equal: Any) -> Rows:
        """Returns the rows whose columns have these values: `rows.where(task="motion", state="done")`."""
        for name in equal:
            self.column(name)
        return Rows(self.columns, (row for row in self if all(row[name] == value for name, value in equal.items())))

    def frame(self) -> pandas.DataFrame:
        """Returns a pandas DataFrame. NULL is NaN in floats, <NA> in whole numbers (Int64) and truth values (boolean),
        None in texts. MissingPackageError without pandas."""
        pandas = require("pandas", "a DataFrame")
        return pandas.DataFrame({name: self._series(pandas, name) for name in self.columns}, columns=self.columns)

    def _series(self, pandas: Any, name: str) -> pandas.Series:
        values = self.column(name)
        kinds = {type(value) for value in values if value is not None}
        missing = any(value is None for value in values)
        if kinds == {bool}:
            return pandas.Series(values, dtype="boolean" if missing else "bool")
        if kinds == {int}:
            return pandas.Series(values, dtype="Int64" if missing else "int64")
        if kinds <= {int, float}:
            return pandas.Series(values, dtype="float64")
        return pandas.Series(values, dtype="object")
