"""A written page, read back: its JSON and its numbers, and what a browser makes of it."""

from __future__ import annotations

import base64
import gzip
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


class Page:
    """The content of a page file."""

    def __init__(self, path: Path) -> None:
        text = path.read_text(encoding="utf-8")
        scripts = dict(re.findall(r'<script type="[^"]*" id="(\w+)">(.*?)</script>', text, re.DOTALL))
        self.text = text
        self.content: dict[str, Any] = json.loads(scripts["page"])
        self.numbers = gzip.decompress(base64.b64decode(scripts["numbers"]))

    def array(self, place: list[int], dtype: str) -> np.ndarray[Any, Any]:
        return np.frombuffer(self.numbers, dtype, place[1], place[0])

    def curve(self, name: str, run: int = 0) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """Times and values of a signal."""
        one = self.content["runs"][run]
        places, values = one["curves"][name][:2]
        return self.array(one["time"], "f8")[self.array(places, "u4")], self.array(values, "f4")


def in_browser(path: Path, actions: str, fragment: str = "") -> Any:
    """What the actions (JavaScript, an expression or a function's body with ``return``) give in the page, in a headless browser.

    The test is skipped where there is no browser.
    """
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        pytest.skip("no Chromium is installed")
    probe = f"""<script>(async () => {{
      const room = document.createElement("pre");
      const shown = text => {{ room.id = "probe"; room.textContent = text; document.body.append(room); }};
      window.addEventListener("error", event => shown(JSON.stringify({{ error: event.message }})));
      const wait = ms => new Promise(done => setTimeout(done, ms));
      while (!document.documentElement.dataset.ready && !document.querySelector(".failed")) await wait(50);
      try {{ shown(JSON.stringify(await (async () => {{ {actions} }})())); }}
      catch (error) {{ shown(JSON.stringify({{ error: String(error) }})); }}
    }})();</script>"""
    probed = path.with_suffix(".probed.html")
    probed.write_text(path.read_text(encoding="utf-8").replace("</body>", f"{probe}</body>"), encoding="utf-8")
    command = [browser, "--headless=new", "--no-sandbox", "--disable-gpu", f"--user-data-dir={path.parent / 'profile'}"]
    command += ["--window-size=1280,2000", "--virtual-time-budget=100000", "--dump-dom", f"{probed.as_uri()}{fragment}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    answered = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
    assert answered, f"the page did not answer: {done.stderr[-2000:]}"
    answer = json.loads(answered[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
    assert not (isinstance(answer, dict) and "error" in answer), answer
    return answer
