# SPDX-License-Identifier: MIT
"""A headless Chromium, driven by the WebDriver protocol of chromedriver: what tests of pages need."""

import base64
import http.client
import json
import os
import shutil
import socket
import subprocess
import tempfile
import time


def missing():
    """What is not installed, as a sentence; empty if all is there."""
    lacking = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    return f"{' and '.join(lacking)} not installed (see tools/packages)" if lacking else ""


class Browser:
    def __init__(self, width=1440, height=900, dark=False):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.profile = tempfile.TemporaryDirectory()
        self.driver = subprocess.Popen(
            [shutil.which("chromedriver"), f"--port={self.port}"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.session = None
        self._wait_for_driver()
        arguments = ["--headless=new", "--hide-scrollbars", f"--window-size={width},{height}",
                     "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                     "--disable-background-networking", "--no-first-run",
                     f"--user-data-dir={self.profile.name}", "about:blank"]
        if os.geteuid() == 0:
            arguments.append("--no-sandbox")
        made = self._call("POST", "/session", {"capabilities": {"alwaysMatch": {
            "browserName": "chrome",
            "goog:chromeOptions": {"binary": shutil.which("chromium"), "args": arguments},
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"}}}})
        self.session = made["sessionId"]
        phone = width < 600
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height,
                     deviceScaleFactor=2 if phone else 1, mobile=phone)
        self.command("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

        self.open("about:blank")
        self.requests()  # of the browser itself

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            if self.session:
                self._call("DELETE", f"/session/{self.session}")
        finally:
            self.driver.terminate()
            self.driver.wait()
            self.profile.cleanup()

    def _wait_for_driver(self):
        end = time.monotonic() + 60
        while True:
            try:
                self._call("GET", "/status")
                return
            except OSError:
                if time.monotonic() > end or self.driver.poll() is not None:
                    raise
                time.sleep(0.05)

    def _call(self, method, path, body=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        try:
            connection.request(method, path, None if body is None else json.dumps(body),
                               {"Content-Type": "application/json"})
            answer = json.loads(connection.getresponse().read())["value"]
        finally:
            connection.close()
        if isinstance(answer, dict) and "error" in answer:
            raise RuntimeError(f"{answer['error']}: {answer['message']}")
        return answer

    def _in_session(self, path, body):
        return self._call("POST", f"/session/{self.session}{path}", body)

    def open(self, address):
        """Seconds until the page is loaded."""
        begun = time.monotonic()
        self._in_session("/url", {"url": address})
        return time.monotonic() - begun

    def run(self, script, *arguments):
        """What the body of a function in JavaScript returns."""
        return self._in_session("/execute/sync", {"script": script, "args": list(arguments)})

    def wait_for(self, script, seconds=20):
        end = time.monotonic() + seconds
        while True:
            found = self.run("return " + script)
            if found:
                return found
            if time.monotonic() > end:
                raise AssertionError(f"never came true: {script}")
            time.sleep(0.05)

    def _element(self, selector):
        found = self._in_session("/element", {"using": "css selector", "value": selector})
        return next(iter(found.values()))

    def click(self, selector):
        """As a user does: scrolls there, and fails if something else is in front."""
        self._in_session(f"/element/{self._element(selector)}/click", {})

    def type(self, selector, text):
        self._in_session(f"/element/{self._element(selector)}/clear", {})
        self._in_session(f"/element/{self._element(selector)}/value", {"text": text})

    def keys(self, *keys):
        """Presses keys one after another, whatever has the focus; WebDriver's names."""
        actions = [{"type": kind, "value": key} for key in keys for kind in ("keyDown", "keyUp")]
        self._in_session("/actions", {"actions": [
            {"type": "key", "id": "keyboard", "actions": actions}]})

    def drag(self, selector, dx, dy):
        """Presses in the middle of an element, moves, and lets go."""
        box = self.run("const r = document.querySelector(arguments[0]).getBoundingClientRect();"
                       "return [r.x + r.width / 2, r.y + r.height / 2];", selector)
        move = {"type": "pointerMove", "duration": 0, "origin": "viewport"}
        self._in_session("/actions", {"actions": [{
            "type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": [
                {**move, "x": round(box[0]), "y": round(box[1])},
                {"type": "pointerDown", "button": 0},
                {**move, "x": round(box[0] + dx), "y": round(box[1] + dy), "duration": 60},
                {"type": "pointerUp", "button": 0}]}]})

    def command(self, name, **parameters):
        return self._in_session("/goog/cdp/execute", {"cmd": name, "params": parameters})

    def picture(self, path, whole=False):
        """A PNG of what is in sight, or of the whole page as far as 3,000 pixels."""
        clip = {}
        if whole:
            width, height = self.run(
                "return [innerWidth, Math.min(document.documentElement.scrollHeight, 3000)]")
            clip = {"captureBeyondViewport": True,
                    "clip": {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}}
        data = base64.b64decode(self.command("Page.captureScreenshot", **clip)["data"])
        with open(path, "wb") as file:
            file.write(data)

    def console(self):
        """What was written to the console since the last time, as (level, text)."""
        return [(entry["level"], entry["message"])
                for entry in self._in_session("/se/log", {"type": "browser"})]

    def requests(self):
        """Addresses that were asked for since the last time."""
        addresses = []
        for entry in self._in_session("/se/log", {"type": "performance"}):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                addresses.append(message["params"]["request"]["url"])
        return addresses
