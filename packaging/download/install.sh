#!/bin/sh
# Installs Chalumeau for the user who runs this: no root, nothing outside the home folder.
#   ./install.sh              copies the plugins and the programs, and says where
#   ./install.sh --uninstall  removes what it copied; presets and instruments of your own stay
set -eu

usage() {
    echo "usage: ./install.sh [--uninstall]" >&2
    exit 2
}

case "${1-}" in
    "" | --uninstall) [ $# -le 1 ] || usage ;;
    -h | --help)
        echo "usage: ./install.sh [--uninstall]"
        exit 0
        ;;
    *) usage ;;
esac

here=$(cd "$(dirname "$0")" && pwd)
system=$(uname -s)
programs=$HOME/.local/bin
case $system in
    Linux)
        clap=$HOME/.clap
        vst3=$HOME/.vst3
        data=${XDG_DATA_HOME:-$HOME/.local/share}
        ;;
    Darwin)
        clap=$HOME/Library/Audio/Plug-Ins/CLAP
        vst3=$HOME/Library/Audio/Plug-Ins/VST3
        data="$HOME/Library/Application Support"
        ;;
    *)
        echo "install.sh knows Linux and macOS, not $system; README.txt says which folders the files go to" >&2
        exit 1
        ;;
esac
# What was made, one path a line: the folders that were not there, then what is in them.
list=$data/chalumeau/installed.txt

uninstall() {
    if [ ! -f "$list" ]; then
        echo "nothing to remove: $list is not there, so this script has installed nothing" >&2
        exit 1
    fi
    while IFS= read -r line; do
        case $line in
            file:*)
                if [ -e "${line#file:}" ]; then
                    rm -r "${line#file:}"
                    echo "removed ${line#file:}"
                fi
                ;;
        esac
    done <"$list"
    # The last that was made is the first to go, and only if nobody else has put something there.
    folders=$(sed -n 's/^folder://p' "$list" | sed '1!G;h;$!d')
    rm "$list"
    # In silence: whoever stops reading would end this between the list and its folder.
    printf '%s\n' "$folders" | while IFS= read -r folder; do
        [ -z "$folder" ] || rmdir "$folder" 2>/dev/null || true
    done
    echo "removed the folders that were made for these, where nothing else is in them"
}

# Makes a folder and those above it, and notes each that was not there.
folder() {
    if [ ! -d "$1" ]; then
        folder "$(dirname "$1")"
        mkdir "$1"
        note "folder:$1"
    fi
}

# Adds a line to the list at once, so that an installation that is broken off can be removed too. The first lines wait until
# there is a folder for the list.
note() {
    waiting="$waiting$1
"
    if [ -d "$(dirname "$list")" ]; then
        printf '%s' "$waiting" >>"$list"
        waiting=
    fi
}

# Copies a file or a folder as $2; replaces what is there.
place() {
    folder "$(dirname "$2")"
    note "file:$2"
    rm -rf "$2"
    cp -R "$1" "$2"
    echo "installed $2"
}

if [ "${1-}" = --uninstall ]; then
    uninstall
    exit 0
fi
if [ -f "$list" ]; then
    echo "removing what was installed before"
    uninstall
fi
waiting=
folder "$(dirname "$list")"
place "$here/Chalumeau.clap" "$clap/Chalumeau.clap"
place "$here/Chalumeau.vst3" "$vst3/Chalumeau.vst3"
place "$here/chalumeau" "$programs/chalumeau"
place "$here/chalumeau-standalone" "$programs/chalumeau-standalone"
if [ "$system" = Linux ]; then
    place "$here/chalumeau.svg" "$data/icons/hicolor/scalable/apps/chalumeau.svg"
    entry=$data/applications/chalumeau.desktop
    place "$here/chalumeau.desktop" "$entry"
    # A desktop may not look for programs in the home folder.
    sed "s|^Exec=.*|Exec=\"$programs/chalumeau-standalone\"|" "$here/chalumeau.desktop" >"$entry"
fi
echo
echo "Let your DAW search for plugins again. Without a DAW: $programs/chalumeau-standalone"
case ":$PATH:" in
    *":$programs:"*) ;;
    *) echo "To type only \"chalumeau\", add $programs to your PATH." ;;
esac
if [ "$system" = Linux ]; then
    echo "Only for a force-feedback knob, and only this needs root:"
    echo "    sudo cp \"$here/70-chalumeau.rules\" /etc/udev/rules.d/"
fi
echo "To remove all of it: $here/install.sh --uninstall"
