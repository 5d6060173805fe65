"""What validating finds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Finding:
    """One broken rule at one place."""

    rule: str
    """Id of the rule; ``os explain RULE`` says what it asks for and why."""
    severity: str
    """``error`` breaks a MUST, ``warning`` a SHOULD; ``advice`` has no part in conformance."""
    expected: str
    """What should be there."""
    found: str
    """What is there."""
    count: int
    """How many alike the finding stands for."""
    table: str | None = None
    """Table concerned, where there is one."""
    row: int | None = None
    """Row concerned, counted from 0."""
    id: str | None = None
    """Thing concerned, such as ``point 7``."""

    def __str__(self) -> str:
        place = ", ".join(
            part for part in (self.table, None if self.row is None else f"row {self.row}", self.id) if part
        )
        many = f" (and {self.count - 1} alike)" if self.count > 1 else ""
        where = f" {place}:" if place else ""
        return f"{self.severity} {self.rule}{where} expected {self.expected}; found {self.found}{many}"


@dataclass(frozen=True)
class Report:
    """The result of validating one sequence; goes through its findings like a list."""

    conformant: bool
    """Whether every MUST holds."""
    findings: tuple[Finding, ...]
    """Errors and warnings: the first ones of each rule and table."""
    advice: tuple[Finding, ...]
    """Advice, which has no part in conformance."""
    rules: tuple[dict[str, Any], ...]
    """How often each rule is broken, in full; rules that hold are left out."""
    rows: dict[str, int]
    """Rows that were checked, by table."""
    json: dict[str, Any]
    """The whole report, as ``os validate --json`` prints it."""

    @classmethod
    def from_json(cls, report: Mapping[str, Any]) -> Report:
        """A report as ``os validate --json`` prints it."""
        return cls(
            conformant=report["conformant"],
            findings=tuple(Finding(**finding) for finding in report["findings"]),
            advice=tuple(Finding(**finding) for finding in report["advice"]),
            rules=tuple(dict(rule) for rule in report["rules"]),
            rows=dict(report["rows"]),
            json=dict(report),
        )

    def __len__(self) -> int:
        return len(self.findings)

    def __bool__(self) -> bool:
        # A report is something, even without findings.
        return True

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __getitem__(self, index: int) -> Finding:
        return self.findings[index]

    def __str__(self) -> str:
        verdict = "conformant" if self.conformant else "not conformant"
        count = sum(self.rows.values())
        return "\n".join([f"{verdict}; {count} rows checked", *(f"  {finding}" for finding in self.findings)])
