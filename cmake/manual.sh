#!/bin/sh
# Makes manual pages and completions in the current folder: manual.sh SOURCE PROGRAM COMMAND...
# with what PROGRAM --help prints, of PROGRAM.1.in; COMMAND... is how it is started.
# Or: manual.sh SOURCE shaded.conf, with what the commented configuration tells.
set -eu
tools=$1/cmake name=$2
settings=$1/config/shaded.conf
shift 2
if [ "$name" = shaded.conf ]; then
    awk -f "$tools/roff.awk" -f "$tools/settings.awk" shaded.conf.5.in "$settings" >shaded.conf.5
    pages=shaded.conf.5
else
    "$@" --help >"$name.help"
    make() {
        form=$1
        shift
        awk -v form="$form" -v program="$name" -f "$tools/roff.awk" -f "$tools/help.awk" "$@" - \
            <"$name.help"
    }
    make man "$name.1.in" >"$name.1"
    make bash >"$name.bash"
    make zsh >"_$name"
    pages=$name.1
fi
# Without a name or a time in it: the same bytes each time.
gzip -9nc "$pages" >"$pages.gz"
