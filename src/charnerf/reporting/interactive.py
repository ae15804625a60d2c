"""Diagrams as plotly's JSON: plain data, so that building them needs no library; drawn in the reader's browser."""

from collections.abc import Mapping, Sequence
from typing import Any

from charnerf.reporting.plots import GRID, PALETTE, Line

DASHES = ("solid", "dash", "dot", "dashdot")


def _color(index: int) -> str:
    """Color of a row."""
    return PALETTE[index % len(PALETTE)]


def _dash(index: int) -> str:
    """Dash of a row: changes where the colors begin again."""
    return DASHES[index // len(PALETTE) % len(DASHES)]


def _layout(**more: Any) -> dict[str, Any]:
    """What all diagrams share."""
    return {
        "template": {"layout": {"colorway": list(PALETTE)}},
        "font": {"family": "system-ui, sans-serif", "size": 13, "color": "#1d1f23"},
        "paper_bgcolor": "#fff",
        "plot_bgcolor": "#fff",
        "margin": {"l": 60, "r": 20, "t": 40, "b": 60},
        "height": 440,
        **more,
    }


def _axis(title: str, **more: Any) -> dict[str, Any]:
    return {"title": {"text": title}, "gridcolor": GRID, "zeroline": False, "linecolor": "#9aa0a8", **more}


def lines_figure(panels: Mapping[str, Mapping[str, Sequence[Line]]], *, x: str) -> dict[str, Any]:
    """Panels side by side with one legend.

    Args:
        panels: By title of the vertical axis, then by row: its lines, several where it has several seeds.
        x: Title of the horizontal axes.
    """
    layout = _layout(legend={"orientation": "h", "y": -0.22}, hovermode="closest")
    data, width, gap = [], 1.0 / len(panels), 0.07
    order = list(dict.fromkeys(row for rows in panels.values() for row in rows))
    named: set[str] = set()
    for place, (title, rows) in enumerate(panels.items()):
        number = "" if place == 0 else str(place + 1)
        left, right = place * width + (gap / 2 if place else 0.0), (place + 1) * width - gap / 2
        layout[f"xaxis{number}"] = _axis(x, domain=[left, min(1.0, right)])
        layout[f"yaxis{number}"] = _axis(title, anchor=f"x{number}")
        for row, lines in rows.items():
            index = order.index(row)
            for xs, ys in lines:
                data.append(
                    {
                        "type": "scatter",
                        "mode": "lines+markers",
                        "x": list(xs),
                        "y": list(ys),
                        "name": row,
                        "legendgroup": row,
                        "showlegend": row not in named,
                        "line": {"color": _color(index), "dash": _dash(index), "width": 1.8},
                        "marker": {"size": 4},
                        "xaxis": f"x{number}",
                        "yaxis": f"y{number}",
                    }
                )
                named.add(row)
    return {"data": data, "layout": layout}


def boxes_figure(
    values: Mapping[str, Mapping[str, Mapping[str, Sequence[float]]]], *, x: str, bins: Sequence[str]
) -> dict[str, Any]:
    """Box plots side by side in every bin, one box a row; buttons choose the metric.

    Args:
        values: By title of the vertical axis (a metric), then by row, then by bin: the values.
        x: Title of the horizontal axis.
        bins: All bins, in order.
    """
    data = []
    for number, rows in enumerate(values.values()):
        for index, (row, by_bin) in enumerate(rows.items()):
            data.append(
                {
                    "type": "box",
                    "name": row,
                    "x": [name for name in bins for _ in by_bin.get(name, ())],
                    "y": [value for name in bins for value in by_bin.get(name, ())],
                    "visible": number == 0,
                    "marker": {"color": _color(index), "size": 3},
                    "line": {"width": 1.2},
                    "boxmean": True,
                }
            )
    owners = [number for number, rows in enumerate(values.values()) for _ in rows]
    buttons = [
        {
            "label": title,
            "method": "update",
            "args": [{"visible": [owner == number for owner in owners]}, {"yaxis.title.text": title}],
        }
        for number, title in enumerate(values)
    ]
    menu = {"buttons": buttons, "type": "buttons", "direction": "right", "x": 0, "xanchor": "left", "y": 1.16}
    layout = _layout(
        boxmode="group",
        xaxis=_axis(x, type="category", categoryorder="array", categoryarray=list(bins)),
        yaxis=_axis(next(iter(values), "")),
        legend={"orientation": "h", "y": -0.22},
        updatemenus=[menu],
    )
    return {"data": data, "layout": layout}
