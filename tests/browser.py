"""A headless Chromium for tests, spoken to by its DevTools protocol over two pipes."""

import fcntl
import json
import os
import shutil
import subprocess
import tempfile
import time
from typing import Any, Self

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "chrome"))), None)


class Browser:
    """One page, with what it wrote to the console in `errors`; skips where there is no browser."""

    def __init__(self, url: str, width: int = 1280, height: int = 900) -> None:
        if CHROMIUM is None:
            pytest.skip("no Chromium is installed")
        self.errors: list[str] = []
        self._asked = 0
        to_browser, self._to = os.pipe()
        self._from, from_browser = os.pipe()
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        options = "--headless --no-sandbox --disable-gpu --remote-debugging-pipe --hide-scrollbars"
        # A page that counts as hidden draws no more pictures.
        options += " --disable-backgrounding-occluded-windows --disable-renderer-backgrounding"
        # The protocol's pipes are 3 and 4 of the browser.
        pipes = [fcntl.fcntl(pipe, fcntl.F_DUPFD, 10) for pipe in (to_browser, from_browser)]
        self._process = subprocess.Popen(
            [CHROMIUM, *options.split(), f"--user-data-dir={self._folder.name}"],
            pass_fds=(3, 4),
            preexec_fn=lambda: [os.dup2(pipe, fd) for fd, pipe in zip((3, 4), pipes, strict=True)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for pipe in (to_browser, from_browser, *pipes):
            os.close(pipe)
        self._read = os.fdopen(self._from, "rb")
        self._session: str | None = None
        try:
            self._open(url, width, height)
        except BaseException:
            self.close()
            raise

    def _open(self, url: str, width: int, height: int) -> None:
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self.ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Runtime", "Log", "Page"):
            self.ask(f"{domain}.enable")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        self.ask("Page.navigate", url=url)
        self.wait("document.readyState === 'complete' && location.href !== 'about:blank'")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the browser."""
        self._process.terminate()
        self._process.wait(20)
        os.close(self._to)
        self._read.close()
        self._folder.cleanup()

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol, and return its answer."""
        self._asked += 1
        message = {"id": self._asked, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = json.loads(self._message())
            if answer.get("id") == self._asked:
                assert "error" not in answer, answer
                return answer["result"]
            if answer.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
                self.errors.append(json.dumps(answer["params"])[:600])

    def _message(self) -> bytes:
        parts = bytearray()
        while (byte := self._read.read(1)) != b"\0":
            assert byte, "the browser has ended"
            parts += byte
        return bytes(parts)

    def value(self, expression: str) -> Any:
        """Return what an expression is on the page."""
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, expression: str, seconds: float = 600.0) -> None:
        """Wait until an expression is true on the page."""
        end = time.monotonic() + seconds
        while not self.value(expression):
            assert time.monotonic() < end, f"never true: {expression}; {self.errors}"
            time.sleep(0.05)

    def click(self, x: float, y: float) -> None:
        """Move the mouse to a place of the window, and click."""
        at = {"x": x, "y": y, "button": "left", "clickCount": 1}
        self.ask("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        time.sleep(0.2)
        for kind in ("mousePressed", "mouseReleased"):
            self.ask("Input.dispatchMouseEvent", type=kind, **at)

    def press(self, key: str) -> None:
        """Press a key, such as ArrowDown."""
        codes = {"ArrowDown": 40, "Tab": 9, "Enter": 13}
        for kind in ("keyDown", "keyUp"):
            self.ask(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                code=key,
                windowsVirtualKeyCode=codes[key],
                text="\r" if key == "Enter" else "",  # a button listens to this
            )
