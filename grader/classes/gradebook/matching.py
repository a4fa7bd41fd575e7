"""Which row of a platform's export belongs to which student: only where there is no doubt."""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from grader.model.batch import Entry

Platform = Literal["canvas", "moodle", "blackboard"]
Kind = Literal["platform", "number", "login", "email", "name", "first", "last", "section"]

# A column's name without blanks and signs, in small letters; the platforms' own names in a few languages.
_KINDS: Mapping[Kind, str] = {
    "number": "sisuserid sisid studentid studentnumber studentno idnumber matriculationnumber matrikelnummer "
    "registrationnumber matricule idnummer númerodeid numérodidentification",
    "login": "sisloginid loginid login username user userid netid uniqueid benutzername anmeldename "
    "nomdutilisateur nombredeusuario",
    "email": "email emailaddress mail emailadresse adressedecourriel direccióndecorreo indirizzoemail",
    "name": "student fullname vollständigername nomcomplet nombrecompleto",
    "first": "firstname givenname vorname prénom nombre nome",
    "last": "lastname surname familyname nachname nomdefamille apellidos apellido cognome",
    "section": "section",
}
_OWN_ID: Mapping[Platform, str] = {
    "canvas": "id canvasid canvasuserid",
    "moodle": "id identifier moodleid participant identifiant identificador",
    "blackboard": "",
}


def kinds(columns: Iterable[str], platform: Platform) -> dict[str, Kind]:
    """What each column says of a student, for those that say anything."""
    known: dict[str, Kind] = {name: kind for kind, names in _KINDS.items() for name in names.split()}
    known |= dict.fromkeys(_OWN_ID[platform].split(), "platform")
    return {column: known[plain(column)] for column in columns if plain(column) in known}


def plain(text: str) -> str:
    """Letters and digits only, small."""
    folded = unicodedata.normalize("NFKC", text).casefold()
    return "".join(sign for sign in folded if sign.isalnum())


def key(text: str) -> str:
    """The same for all that is written alike: invisible signs, case and blanks do not tell students apart."""
    shown = "".join(
        sign for sign in unicodedata.normalize("NFKC", text) if unicodedata.category(sign) != "Cf"
    )
    return " ".join(shown.casefold().split())


@dataclass(kw_only=True)
class Identity:
    """What is known of one student. `sure` are pairs of a kind and a key that belong to one person only."""

    sure: set[tuple[str, str]] = field(default_factory=set)
    name: str = ""


def row_identity(fields: Mapping[str, str], known: Mapping[str, Kind]) -> Identity:
    """Of a row of a platform's export, or of a roster's further columns."""
    identity, first, last = Identity(), "", ""
    for column, kind in known.items():
        text = key(fields.get(column, ""))
        if not text or kind == "section":
            continue
        if kind == "name":
            identity.name = _turned(text)
        elif kind == "first":
            first = text
        elif kind == "last":
            last = text
        else:
            identity.sure.add(_sure(kind, text))
    identity.name = identity.name or " ".join(part for part in (first, last) if part)
    return identity


def entry_identity(entry: Entry, platform: Platform) -> Identity:
    """Of a submission. Its id may be any of the platform's."""
    identity = row_identity(entry.extra, kinds(entry.extra, platform))
    identity.sure |= {(kind, key(entry.id)) for kind in ("platform", "number", "login")}
    identity.name = _turned(key(entry.name)) or identity.name
    if any(kind == "platform" and text in identity.name.split() for kind, text in identity.sure):
        identity.name = ""  # `Participant 123` is no one's name
    return identity


def _sure(kind: Kind, text: str) -> tuple[str, str]:
    """Many log in by their address, so both are one kind. Moodle writes `Participant 123` for the number 123."""
    if kind == "platform":
        number = re.search(r"\d+$", text)
        return kind, number.group() if number else text
    return ("login" if kind == "email" else kind), text


def _turned(name: str) -> str:
    """`lovelace, ada` is `ada lovelace`."""
    last, comma, first = name.partition(",")
    return " ".join(f"{first} {last}".split()) if comma else name


@dataclass(frozen=True, kw_only=True)
class Matched:
    """`rows` gives the row of each submission, by their places; `doubtful` says why others have none."""

    rows: dict[int, int]
    doubtful: dict[int, str]


def match(ours: Sequence[Identity], theirs: Sequence[Identity]) -> Matched:
    """By what belongs to one person only, and where nothing of that is known on one side, by name."""
    by_sure, by_name = defaultdict[tuple[str, str], set[int]](set), defaultdict[str, set[int]](set)
    for place, identity in enumerate(theirs):
        for sure in identity.sure:
            by_sure[sure].add(place)
        if identity.name:
            by_name[identity.name].add(place)
    found = {}
    for place, identity in enumerate(ours):
        rows = set().union(*(by_sure.get(sure, set()) for sure in identity.sure))
        found[place] = rows or by_name.get(identity.name, set())
        found[place] = {row for row in found[place] if not _contradict(identity, theirs[row])}
    wanted = defaultdict[int, list[int]](list)
    for place, rows in found.items():
        for row in rows:
            wanted[row].append(place)
    doubtful = {place: why for place, rows in found.items() if (why := _doubt(rows, wanted))}
    return Matched(
        rows={place: next(iter(rows)) for place, rows in found.items() if place not in doubtful},
        doubtful=doubtful,
    )


def _contradict(ours: Identity, theirs: Identity) -> bool:
    """Whether only the platform's number says so, and the names have nothing in common: Moodle numbers teams too."""
    if not (ours.name and theirs.name) or any(kind != "platform" for kind, _ in ours.sure & theirs.sure):
        return False
    name = plain(ours.name)
    return not any(plain(word) in name for word in theirs.name.split() if len(word) > 1)


def _doubt(rows: set[int], wanted: dict[int, list[int]]) -> str:
    if not rows:
        return "no row there has this id, number, login, address or name"
    if len(rows) > 1:
        return f"{len(rows)} rows there could be this student"
    (row,) = rows
    return "another submission fits the same row" if len(wanted[row]) > 1 else ""
