"""`make links`: whether the pages' links to other sites still answer. Ends with 1 where one does not."""

from __future__ import annotations

import http.client
import sys
from concurrent.futures import ThreadPoolExecutor
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

from scripts.pages import external_links, pages

LIMIT_S = 20
REFUSES_ROBOTS = {401, 403, 405, 429}


def problem(address: str) -> str:
    """What is wrong with it; empty where nothing is. A site that only refuses programs counts as there."""
    request = Request(address, headers={"User-Agent": "Mozilla/5.0 (link check)"})  # noqa: S310 - http(s) alone is given
    try:
        with urlopen(request, timeout=LIMIT_S):  # noqa: S310 - as above
            return ""
    except HTTPError as error:
        return "" if error.code in REFUSES_ROBOTS else f"{error.code} {error.reason}"
    except (URLError, TimeoutError, http.client.HTTPException, ConnectionError) as error:
        return str(error)


def main() -> int:
    """Ask for each address once, several side by side."""
    where: dict[str, str] = {}
    for path in pages():
        for address in external_links(path.read_text(encoding="utf-8")):
            where.setdefault(address.partition("#")[0], str(path))
    with ThreadPoolExecutor(max_workers=8) as pool:
        found = list(zip(where.items(), pool.map(problem, where), strict=True))
    wrong = [f"{path}: {address}: {said}" for (address, path), said in found if said]
    print("\n".join([*wrong, f"{len(found)} addresses, {len(wrong)} do not answer"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
