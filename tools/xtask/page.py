"""Writes the page that shows the machines in a browser: page.py TARGET [--open]. TARGET is cargo's target folder. With
--open, also opens the page. The page is one file, which contains its style, its script and the machines as WebAssembly.
So the page works from a folder and from any static host. Its security policy allows only its own style and script, by
their hashes, and pictures that the page itself contains. The page can therefore load nothing and send nothing."""
import base64
import gzip
import hashlib
import pathlib
import shutil
import sys
import webbrowser

target = pathlib.Path(sys.argv[1])
page = pathlib.Path("host/web/page")
built = target / "wasm32-unknown-unknown/wasm/bound"


def base64_of(content):
    return base64.b64encode(content).decode()


def hash_of(text):
    return "sha256-" + base64_of(hashlib.sha256(text.encode()).digest())


style = (page / "style.css").read_text()
machines = base64_of(gzip.compress((built / "machines_bg.wasm").read_bytes(), mtime=0))
script = (built / "machines.js").read_text() + f"const MACHINES = '{machines}';\n"
script += (page / "draw.js").read_text() + (page / "page.js").read_text()
policy = (
    f"default-src 'none'; img-src data:; style-src '{hash_of(style)}'; script-src '{hash_of(script)}' 'wasm-unsafe-eval'; "
    "base-uri 'none'; form-action 'none'"
)
html = (page / "index.html").read_text()
for place, content in [("{policy}", policy), ("{style}", style), ("{script}", script)]:
    before, behind = html.split(place, 1)
    html = before + content + behind
# Only the page is in this folder, so that the folder can be published.
shutil.rmtree(target / "web", ignore_errors=True)
(target / "web").mkdir()
file = target / "web/index.html"
file.write_text(html)
print(f"{file}: {len(html.encode())} bytes")
if "--open" in sys.argv:
    webbrowser.open(file.as_uri())
