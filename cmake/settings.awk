# Makes shaded.conf(5) of the commented configuration: awk -f roff.awk -f settings.awk SKELETON shaded.conf
#
# "# ---- NAME ----" begins a section, "key = value" (or "; key = value", if it is not set by default)
# is an option, of which the comment above it tells. Several options below one comment share it. What
# stands before the first section is for %ABOUT%, and all others for %SETTINGS%.

# The options that were read, and what is told of them.
function flush_options() {
    if (options != "") settings = settings options sentences(comment)
    else if (comment != "" && in_sections) settings = settings sentences(comment)
    else if (comment != "") about = about (about == "" ? "" : ".PP\n") sentences(comment)
    options = comment = ""
}

FNR == NR { skeleton[++line_count] = $0; next }
/^# ---- .* ----$/ {
    flush_options()
    in_sections = 1
    sub(/^# ---- /, "")
    sub(/ ----$/, "")
    settings = settings ".SS \"" roff($0) "\"\n"
    next
}
/^(; )?[a-z-]+ = / {
    sub(/^; /, "")
    options = options (options == "" ? ".TP\n" : ".TQ\n") "\\fB" roff($0) "\\fR\n"
    next
}
/^# ?/ {
    if (options != "") flush_options()
    sub(/^# ?/, "")
    comment = comment (comment == "" ? "" : " ") $0
    next
}
/^$/ { flush_options() }
END {
    flush_options()
    for (i = 1; i <= line_count; i++)
        if (skeleton[i] == "%ABOUT%") printf "%s", about
        else if (skeleton[i] == "%SETTINGS%") printf "%s", settings
        else print skeleton[i]
}
