"""Times every single test and fails when one passes the seconds given. Reads cargo's messages from standard input."""

import json
import os
import subprocess
import sys

budget = float(sys.argv[1])
binaries = []
for line in sys.stdin:
    message = json.loads(line)
    if message.get("reason") == "compiler-artifact" and message.get("executable") and message["profile"]["test"]:
        folder = os.path.dirname(message["manifest_path"])
        binaries.append((message["executable"], folder))
if not binaries:
    sys.exit("no test binary: cargo printed none")

times = []
failed = []
for executable, folder in binaries:
    command = [executable, "-Zunstable-options", "--report-time", "--format", "json"]
    environment = dict(os.environ, RUSTC_BOOTSTRAP="1", CARGO_MANIFEST_DIR=folder)
    run = subprocess.run(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True, check=False)
    name = os.path.basename(executable).rsplit("-", 1)[0]
    seen = len(times)
    for line in run.stdout.splitlines():
        try:
            event = json.loads(line)
        except ValueError:
            continue
        if event.get("type") == "test" and "exec_time" in event:
            times.append((float(event["exec_time"]), f"{name}::{event['name']}"))
    # A harness of its own (a benchmark) reports nothing and is not held to the budget; libtest reports at least its suite.
    if run.returncode:
        failed.append(f"{name} ended with {run.returncode} after {len(times) - seen} tests")

times.sort(reverse=True)
print(f"{len(times)} tests; the slowest:")
for seconds, name in times[:10]:
    print(f"{seconds:8.2f} s  {name}")
slow = [f"{name}: {seconds:.1f} s" for seconds, name in times if seconds > budget]
if slow or failed or not times:
    sys.exit("\n".join([f"over {budget:.0f} s:" if slow else "", *slow, *failed, "" if times else "no test was timed"]).strip())
