#!/usr/bin/env python3
"""Makes the pages and plots of a folder of benchmark reports (JSON, see report.h), in that folder."""
import json
import pathlib
import sys

import plots


def cell(value):
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)


def markdown_table(rows):
    columns = list(dict.fromkeys(key for row in rows for key in row))
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for row in rows:
        lines.append("| " + " | ".join(cell(row.get(c, "–")) for c in columns) + " |")
    return "\n".join(lines) + "\n"


def section(report):
    quick = ", quick run" if report["quick"] else ""
    parts = [f"## {report['benchmark']}\n",
             f"Commit {report['commit']}, {report['date']}{quick}; {report['cpu']}, "
             f"{report['cores']} cores, {report['compiler']}"
             f"{', ' + report['gpu'] if 'gpu' in report else ''}.\n"]
    parts += [f"- {remark}" for remark in report["remarks"]]
    for title, rows in report["tables"].items():
        parts.append(f"\n### {title}\n\n{markdown_table(rows)}")
    if report["targets"]:
        parts.append(f"\n### Targets\n\n{markdown_table(report['targets'])}")
    return "\n".join(parts)


def write_page(reports, folder):
    """`reports`: of one benchmark, of this machine and that."""
    name = reports[0]["benchmark"]
    text = f"# {reports[0]['page']}\n\nMade by `{reports[0].get('made_by', f'benchmarks/run.sh {name}')}`; do not edit.\n\n"
    parts = [section(report).partition("\n")[2] for report in reports]
    (folder / f"{name}.md").write_text(text + "\n\n---\n".join(parts))


def main(folder):
    reports = [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]
    text = "# Benchmark results\n\nMade by `benchmarks/run.sh`; do not edit.\n\n"
    of_tables = [r for r in reports if "page" not in r]
    (folder / "tables.md").write_text(text + "\n".join(section(r) for r in of_tables))
    for name in {r["benchmark"]: None for r in reports if "page" in r}:
        write_page([r for r in reports if r["benchmark"] == name], folder)
    for report in reports:
        plot = getattr(plots, report["benchmark"], None)
        if plot:
            plot(report, folder / f"{report['benchmark']}.png")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: tables.py FOLDER")
    main(pathlib.Path(sys.argv[1]))
