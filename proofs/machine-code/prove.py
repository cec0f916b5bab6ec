"""prove.py IMAGE...: proves the step that takes a byte, in each image, and compares the prover's model of the processor
with QEMU. Prints the results in the format of Rust's tests."""

import sys
import qemu
from image import Failure, Image
from steps import Step

def passes(path, step, name, check):
    try:
        classification, says = "ok", check(step)
    except Failure as failure:
        classification, says = "FAILED", failure
    print(f"test {path}, {step.kind}: {name} ... {classification}: {says}", flush=True)
    return classification == "ok"

steps = [(path, Step(Image(path))) for path in sys.argv[1:]]
print(f"running {2 * len(steps)} tests", flush=True)
passed = [passes(path, step, "does as specified", Step.prove) for path, step in steps]
if all(passed):
    passed += [passes(path, step, "the processor is QEMU's", qemu.compare) for path, step in steps]
print(f"test result: {sum(passed)} passed; {passed.count(False)} failed; 0 ignored")
sys.exit(not all(passed))
