"""Which differences between rows hold, as a table and in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from charnerf.reporting.blocks import Block, Bullets, Heading, Table, Text
from charnerf.reporting.bootstrap import LEVEL, RESAMPLES, Difference, compare_rows
from charnerf.reporting.characters import scores_by_character
from charnerf.reporting.families import families
from charnerf.reporting.formats import NONE
from charnerf.reporting.rows import Row
from charnerf.wording import counted

METRICS = {
    "psnr": ("PSNR", "{:.2f} dB"),
    "psnr_foreground": ("foreground PSNR", "{:.2f} dB"),
    "ssim": ("SSIM", "{:.3f}"),
    "silhouette_iou": ("IoU", "{:.3f}"),
}
MANY = 8  # rows whose pairs are still read
ATTENTION, RIVALS = "charnerf", ("pixelnerf", "no_mha", "no_view")
JUDGED = ("psnr", "psnr_foreground", "ssim")


@dataclass(frozen=True)
class Question:
    """Rows that are compared with each other, p-values corrected over their pairs.

    Attributes:
        title: What is compared, "" where that is everything.
        rows: All rows of the pairs.
        pairs: Their labels, two by two.
    """

    title: str
    rows: tuple[Row, ...]
    pairs: tuple[tuple[str, str], ...]


def questions_of(rows: Sequence[Row]) -> list[Question]:
    """Which rows of a report to compare.

    The rows of each Table II all with each other; two tables row by row; further rows with each other where they are few, with
    one of them where they are many: the one that changes nothing, else the best on the foreground.
    """
    every = families(rows)
    tables = [family for family in every if family.of_paper]
    questions = [Question(family.variant, family.rows, _all_pairs(family.rows)) for family in tables]
    for first, second in combinations(tables, 2):
        names = {row.experiment: row.label for row in second.rows}
        pairs = tuple((row.label, names[row.experiment]) for row in first.rows if row.experiment in names)
        if pairs:
            title = f"{first.variant or 'as it is'} against {second.variant or 'as it is'}"
            questions.append(Question(title, (*first.rows, *second.rows), pairs))
    for family in every:
        if family.of_paper or len(family.rows) < 2:
            continue
        if len(family.rows) <= MANY:
            questions.append(Question("further rows" if tables else "", family.rows, _all_pairs(family.rows)))
            continue
        against = next((row for row in family.rows if not row.variant), family.rows[0])
        pairs = tuple((row.label, against.label) for row in family.rows if row is not against)
        questions.append(Question(f"every row against {against.label}", family.rows, pairs))
    return questions


def _all_pairs(rows: Sequence[Row]) -> tuple[tuple[str, str], ...]:
    return tuple(combinations([row.label for row in rows], 2))


def differences(
    rows: Sequence[Row], pairs: Sequence[tuple[str, str]] | None = None
) -> dict[str, list[Difference]]:
    """Pairs of rows (all of them by default) by metric, p-values corrected over the pairs of a metric."""
    return {
        key: compare_rows({row.label: scores_by_character(row, key) for row in rows}, pairs=pairs)
        for key in METRICS
    }


def significance(rows: Sequence[Row]) -> list[Block]:
    """Which differences hold: in words, then every pair."""
    return [block for question in questions_of(rows) for block in _answer(question)]


def _answer(question: Question) -> list[Block]:
    pairs = differences(question.rows, question.pairs)
    counts = sorted({one.num_characters for each in pairs.values() for one in each})
    title = "Which differences hold"
    heading = Heading(f"{title}: {question.title}" if question.title else title)
    if not counts:
        return [heading, Text("The rows share no test character: nothing can be paired.")]
    blocks: list[Block] = [heading]
    number = " or ".join(map(str, counts))
    method = (
        f"Paired bootstrap over {number} test {'character' if counts == [1] else 'characters'}, {RESAMPLES:,} resamples, seeds"
        " averaged first; a difference holds where p, corrected over the pairs by Holm, is below 0.05. Intervals are 95 %, of"
        " each pair alone. Resampling characters says nothing about training noise: for that, several seeds."
    )
    blocks.append(Text(method))
    smallest = max(map(len, pairs.values())) * 2.0 ** (1 - counts[-1])
    if smallest >= 1.0 - LEVEL:
        warning = (
            f"So few characters can not decide so many pairs at once: p is at least {min(1.0, smallest):.2g}."
        )
        blocks.append(Text(f"{warning} The intervals of single pairs still tell."))
    verdict = attention_verdict(question.rows, pairs)
    if verdict:
        blocks.append(Text(verdict))
    order = [row.label for row in question.rows]
    blocks.append(Bullets([sentence(key, pairs[key], order) for key in METRICS]))
    return [*blocks, _table(pairs, question.pairs)]


def sentence(key: str, pairs: Sequence[Difference], order: Sequence[str]) -> str:
    """What holds in one metric, by row."""
    title, form = METRICS[key]
    parts = []
    for label in order:
        ahead = [one for one in pairs if one.first == label and one.holds]
        if ahead:
            parts.append(
                f"{label} is ahead of {', '.join(f'{one.second} by {form.format(one.mean)}' for one in ahead)}"
            )
    open_ = sum(not one.holds for one in pairs)
    if not parts:
        return f"{title}: no difference holds ({counted(open_, 'pair')})."
    rest = (
        f"; the other {open_} of {counted(len(pairs), 'pair')} can not be told apart"
        if open_
        else "; that is every pair"
    )
    return f"{title}: {'; '.join(parts)}{rest}."


def attention_verdict(rows: Sequence[Row], differences: Mapping[str, Sequence[Difference]]) -> str | None:
    """Whether view attention earns its place against the rows without; None where the grid has not both."""
    if len({row.variant for row in rows if row.experiment == ATTENTION}) > 1:  # one table against another
        return None
    labels = {row.experiment: row.label for row in rows if row.experiment is not None}
    rivals = [labels[name] for name in RIVALS if name in labels]
    if ATTENTION not in labels or not rivals:
        return None
    ours = labels[ATTENTION]
    standing: dict[str, list[str]] = {"ahead": [], "behind": [], "undecided": []}
    for rival in rivals:
        states: dict[str, list[str]] = {}
        for key in JUDGED:
            pair = next((one for one in differences[key] if {one.first, one.second} == {ours, rival}), None)
            if pair is not None:
                state = "undecided" if not pair.holds else "ahead" if pair.first == ours else "behind"
                states.setdefault(state, []).append(METRICS[key][0])
        for state, names in states.items():
            standing[state].append(f"against {rival} ({', '.join(names)})")
    parts = [f"{state} {', '.join(names)}" for state, names in standing.items() if names]
    earned = parts and not standing["behind"] and not standing["undecided"]
    start = (
        "View attention earns its place here"
        if earned
        else "View attention does not clearly earn its place here"
    )
    return f"{start}: {ours} is {'; '.join(parts)}." if parts else None


def _table(differences: Mapping[str, Sequence[Difference]], pairs: Sequence[tuple[str, str]]) -> Table:
    """Every pair: difference, interval and corrected p in each metric; a star where it holds."""
    rows = []
    for first, second in pairs:
        cells = []
        for key, each in differences.items():
            pair = next((one for one in each if {one.first, one.second} == {first, second}), None)
            cells.append(
                NONE if pair is None else _cell(pair, key, sign=1.0 if pair.first == first else -1.0)
            )
        rows.append([f"{first} - {second}", *cells])
    return Table(["pair", *(METRICS[key][0] for key in differences)], rows)


def _cell(pair: Difference, key: str, *, sign: float) -> str:
    low, high = sorted((sign * pair.low, sign * pair.high))
    form = METRICS[key][1].removesuffix(" dB")
    signed = form.replace(":", ":+")
    cell = (
        f"{signed.format(sign * pair.mean)} ({form.format(low)} to {form.format(high)}), p {pair.p_value:.2g}"
    )
    return f"{cell} *" if pair.holds else cell
