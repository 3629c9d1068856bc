# Make rules from the `use` statements of Fortran sources:
#    awk -v build=build/opt -f tools/depends.awk src/base/kinds.f90 test/unit/lists.f90 ...
# Only modules defined in these sources count; intrinsic and library modules have no rule. For each source it prints the modules
# that its object waits for, for each module the object that makes it, and the lists `modules`, `test_programs` and
# `test_objects` (test sources that are not programs).

function object(path) { sub(/\.[fF]90$/, ".o", path); return build "/obj/" path }

function statement(text,   name) {
   gsub(/^[ \t]+|[ \t]+$/, "", text)
   if (text ~ /^module[ \t]+[a-z][a-z0-9_]*$/) {
      name = text; sub(/^module[ \t]+/, "", name)
      if (name in made_by) {
         printf "%s and %s both define module %s\n", made_by[name], FILENAME, name > "/dev/stderr"; failed = 1
      }
      made_by[name] = FILENAME
      modules = modules " " name
   } else if (text ~ /^submodule[ \t]*\(/) {
      name = text; sub(/^submodule[ \t]*\([ \t]*/, "", name); sub(/[ \t:)].*$/, "", name)
      uses[FILENAME] = uses[FILENAME] " " name
   } else if (text ~ /^program[ \t]+[a-z][a-z0-9_]*$/) {
      is_program[FILENAME] = 1
   } else if (text ~ /^use([ \t]|,|::)/ && text !~ /^use[ \t]*,[ \t]*intrinsic/) {
      name = text
      if (name ~ /::/) sub(/^use[^:]*::[ \t]*/, "", name); else sub(/^use[ \t]+/, "", name)
      if (match(name, /^[a-z][a-z0-9_]*/) && substr(name, RLENGTH + 1) ~ /^[ \t]*(,|&|$)/)
         uses[FILENAME] = uses[FILENAME] " " substr(name, 1, RLENGTH)
   }
}

FNR == 1 { files[++count] = FILENAME }

{
   line = tolower($0)
   sub(/\r$/, "", line)
   if (line !~ /^[ \t]*(use|module|submodule|program|block[ \t]*;)/) next
   sub(/!.*$/, "", line)
   parts = split(line, part, ";")
   for (n = 1; n <= parts; n++) statement(part[n])
}

END {
   if (failed) exit 1
   for (n = 1; n <= count; n++) {
      file = files[n]
      wanted = split(uses[file], name, " ")
      rule = ""
      split("", seen)
      for (m = 1; m <= wanted; m++) {
         if (!(name[m] in made_by) || name[m] in seen || made_by[name[m]] == file) continue
         seen[name[m]] = 1
         rule = rule " " build "/mod/" name[m] ".mod"
      }
      if (rule != "") print object(file) ":" rule
      if (file ~ /^test\//) {
         if (file in is_program) programs = programs " " file
         else objects = objects " " object(file)
      }
   }
   listed = split(modules, name, " ")
   for (n = 1; n <= listed; n++) print build "/mod/" name[n] ".mod: " object(made_by[name[n]])
   print "modules :=" modules
   print "test_programs :=" programs
   print "test_objects :=" objects
}
