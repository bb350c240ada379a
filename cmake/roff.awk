# Text for manual pages: what help.awk and settings.awk share.

# `x` in bold; "-" as it is typed, and no line that begins as a request does.
function roff(text,    out, quoted, at) {
    gsub(/\\/, "\\e", text)
    gsub(/-/, "\\-", text)
    while ((at = index(text, "`")) > 0) {
        out = out substr(text, 1, at - 1) (quoted ? "\\fR" : "\\fB")
        text = substr(text, at + 1)
        quoted = !quoted
    }
    return safe(out text)
}

function safe(line) { return line ~ /^[.\047]/ ? "\\&" line : line }

# Lines of up to 79 characters.
function wrapped(text,    out, line, words, n, i) {
    n = split(text, words, " ")
    for (i = 1; i <= n; i++)
        if (line == "") line = words[i]
        else if (length(line) + 1 + length(words[i]) < 80) line = line " " words[i]
        else {
            out = out safe(line) "\n"
            line = words[i]
        }
    return line == "" ? out : out safe(line) "\n"
}

# Each sentence on lines of its own, by which roff knows where it ends.
function sentences(text,    out) {
    text = roff(text)
    while (match(text, /[.:;] [A-Z(]/)) {
        out = out wrapped(substr(text, 1, RSTART))
        text = substr(text, RSTART + 2)
    }
    return out wrapped(text)
}
