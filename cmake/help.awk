# Makes parts of manual pages, and completions for shells, of what a program's --help prints:
#
#     PROGRAM --help | awk -v form=man -v program=NAME -f roff.awk -f help.awk SKELETON -
#     PROGRAM --help | awk -v form=bash -v program=NAME -f roff.awk -f help.awk -
#
# Of the help this is read: lines that begin with blanks and a "-" are flags, those that begin with
# the program's name are its commands, and lines that are indented further go on with what is above.
# Two blanks part a flag from what is said of it. Other lines are paragraphs; the line of the usage
# is left out, and a paragraph that begins with "Exit status: " is a section of its own.
# In a skeleton, lines of %ABOUT%, %COMMANDS%, %OPTIONS%, %NOTES% and %EXIT% stand for that.

function keep_paragraph() {
    sub(/^ +/, "", paragraph)
    if (paragraph ~ /^Exit status: /) exits = substr(paragraph, 14)
    else if (paragraph != "" && paragraph !~ /^Usage: /) {
        if (flag_count + command_count) notes[++note_count] = paragraph
        else about[++about_count] = paragraph
    }
    paragraph = ""
}

function add(text) { return (paragraph == "" ? "" : paragraph " ") text }

function read_help(line,    spec, text, at) {
    # Behind the blanks that flags begin with.
    at = match(substr(line, 7), /[^ ]  +/)
    spec = at ? substr(line, 1, 6 + at) : line
    text = at ? substr(line, 6 + RSTART + RLENGTH) : ""
    sub(/^ +/, "", spec)
    if (line ~ /^ ( |     )-/) {
        keep_paragraph()
        flags[++flag_count] = spec
        saying = "flag"
        said_of_flag[flag_count] = text
    } else if (index(line, "  " program " ") == 1) {
        keep_paragraph()
        commands[++command_count] = spec
        saying = "command"
        said_of_command[command_count] = text
    } else if (line ~ /^            / && saying != "") {
        sub(/^ +/, "", line)
        if (saying == "flag") said_of_flag[flag_count] = said_of_flag[flag_count] " " line
        else said_of_command[command_count] = said_of_command[command_count] " " line
    } else if (line == "") {
        keep_paragraph()
        saying = ""
    } else {
        # A sentence of its own line is a paragraph where the line before was one, too.
        if (line ~ /^(SIGTERM|Exit status:|Serves) ?/ && paragraph ~ /[.]$/) keep_paragraph()
        if (paragraph ~ /^Usage: /) keep_paragraph()
        paragraph = add(line)
        saying = ""
    }
}

# ---- Manual pages ----

function print_text(text) { printf "%s", sentences(text) }

function print_paragraphs(list, count,    i) {
    for (i = 1; i <= count; i++) {
        if (i > 1) print ".PP"
        print_text(list[i])
    }
}

function stopped(text) { return text ~ /[.]$/ ? text : text "." }

# Words in capitals stand for what the user writes.
function print_heading(spec) {
    spec = roff(spec)
    gsub(/[A-Z][A-Z:]+/, "\\fI&\\fB", spec)
    print ".TP\n\\fB" spec "\\fR"
}

function print_manual_line(line,    i) {
    if (line == "%ABOUT%") print_paragraphs(about, about_count)
    else if (line == "%NOTES%") print_paragraphs(notes, note_count)
    else if (line == "%EXIT%") print_text(toupper(substr(exits, 1, 1)) substr(exits, 2))
    else if (line == "%COMMANDS%")
        for (i = 1; i <= command_count; i++) {
            print_heading(commands[i])
            print_text(stopped(said_of_command[i]))
        }
    else if (line == "%OPTIONS%")
        for (i = 1; i <= flag_count; i++) {
            print_heading(flags[i])
            print_text(stopped(said_of_flag[i] == "" ? "this text, or the version" : said_of_flag[i]))
        }
    else print line
}

# ---- Completions ----

# "FILE", "on|off", ... of flag i; "" if it has no argument. Sets `names` to its names.
function argument_of(i,    parts, n, k, argument) {
    names = argument = ""
    n = split(flags[i], parts, /[ ,]+/)
    for (k = 1; k <= n; k++)
        if (parts[k] ~ /^-/) names = names (names == "" ? "" : " ") parts[k]
        else argument = parts[k]
    return argument
}

# What may stand for an argument: words, or "@file", or nothing that is known.
function choices(argument, text) {
    if (argument == "FILE" || argument == "OUT") return "@file"
    if (argument ~ /[|]/) {
        gsub(/[|]/, " ", argument)
        return argument
    }
    # "portable, avx2 or neon: what it is; auto: the widest". Other names are the user's.
    if (argument == "NAME" && text ~ /auto/) {
        sub(/:.*/, "", text)
        gsub(/,| or /, " ", text)
        gsub(/ +/, " ", text)
        return text " auto"
    }
    return ""
}

function command_names(    i, parts, all) {
    for (i = 1; i <= command_count; i++) {
        split(commands[i], parts, " ")
        all = all (all == "" ? "" : " ") parts[2]
    }
    return all
}

function print_bash(    i, argument, list, all, patterns) {
    print "# Completion of " program " in bash, made of what " program " --help prints."
    print "_" program "() {"
    print "    local word=${COMP_WORDS[COMP_CWORD]} last=${COMP_WORDS[COMP_CWORD-1]}"
    print "    COMPREPLY=()"
    print "    case $last in"
    for (i = 1; i <= flag_count; i++) {
        argument = argument_of(i)
        all = all (all == "" ? "" : " ") names
        if (argument == "") continue
        patterns = names
        gsub(/ /, " | ", patterns)
        list = choices(argument, said_of_flag[i])
        print "    " patterns ")"
        if (list == "@file")
            print "        compopt -o filenames\n        mapfile -t COMPREPLY < <(compgen -f -- \"$word\")"
        else if (list != "")
            print "        mapfile -t COMPREPLY < <(compgen -W \"" list "\" -- \"$word\")"
        print "        return\n        ;;"
    }
    print "    esac"
    print "    if [[ $word == -* ]]; then"
    print "        mapfile -t COMPREPLY < <(compgen -W \"" all "\" -- \"$word\")"
    if (command_count) {
        print "    elif ((COMP_CWORD == 1)); then"
        print "        mapfile -t COMPREPLY < <(compgen -W \"" command_names() "\" -- \"$word\")"
        print "    else"
        print "        compopt -o filenames\n        mapfile -t COMPREPLY < <(compgen -f -- \"$word\")"
    }
    print "    fi\n}\ncomplete -F _" program " " program
}

# Text in a specification of _arguments, within single quotes.
function zsh_text(text) {
    gsub(/['`\\]/, "", text)
    gsub(/\[/, "(", text)
    gsub(/\]/, ")", text)
    gsub(/:/, "\\:", text)
    return text
}

function print_zsh(    i, k, n, parts, argument, list, action) {
    print "#compdef " program "\n# Made of what " program " --help prints."
    print "_arguments -S \\"
    for (i = 1; i <= flag_count; i++) {
        argument = argument_of(i)
        list = choices(argument, said_of_flag[i])
        action = list == "@file" ? "_files" : list == "" ? " " : "(" list ")"
        n = split(names, parts, " ")
        for (k = 1; k <= n; k++)
            print "    '" parts[k] "[" zsh_text(said_of_flag[i]) "]" \
                (argument == "" ? "" : ":" zsh_text(argument) ":" action) "' \\"
    }
    if (command_count) print "    '1:command:(" command_names() ")' \\\n    '*:scene:_files'"
    else print "    '*: :'"
}

form == "man" && FILENAME != "-" { skeleton[++line_count] = $0; next }
{ read_help($0) }
END {
    keep_paragraph()
    if (!flag_count) {
        print "help.awk: " program " --help has no flags" >"/dev/stderr"
        exit 1
    }
    if (form == "bash") print_bash()
    else if (form == "zsh") print_zsh()
    else for (i = 1; i <= line_count; i++) print_manual_line(skeleton[i])
}
