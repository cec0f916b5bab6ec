#!/bin/bash -eu
# Licensed under Apache-2.0 (http://www.apache.org/licenses/LICENSE-2.0) or MIT.
# ClusterFuzzLite and OSS-Fuzz build the targets in the same way.
exec "$SRC/framelock/.clusterfuzzlite/build.sh"
