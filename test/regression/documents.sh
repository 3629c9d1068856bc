#!/bin/sh
#test: beside check
# Documents and what they name (documents.py): prose of at most 110 columns, links, equations and paths that exist, the README's scene,
# and the floors of the source. What is planted here must be noticed.
. "$(dirname "$0")/../harness/env.sh"

check() { "$PYTHON" "$ROOT/test/regression/documents.py" "$1"; }
check "$ROOT" || fail 'documents'

mkdir tree
for part in README.md CHANGELOG.md CONTRIBUTING.md Makefile LICENSE CITATION.cff ruff.toml mk doc src test post input packaging tools; do
   cp -r "$ROOT/$part" tree/
done
: >expected
planted() { # planted FAULT FILE TEXT: that text at the file's end is a fault, to be told in these words
   printf '%b\n' "$3" >>"tree/$2"
   echo "$1" >>expected
}
planted 'input.md: line .* has 149 columns' doc/user/input.md "\n$(printf 'word %.0s' $(seq 30))"
planted 'input.md: .*(nowhere.md): no such file' doc/user/input.md '\n[there](nowhere.md)'
planted 'input.md: .*#nowhere): no such heading' doc/user/input.md '\n[there](output.md#nowhere)'
planted 'output.md: theory.md, eq. nowhere: no such equation' doc/user/output.md '\nAs in theory.md, eq. nowhere.'
planted 'design.md: src/base/nowhere.f90: no such file' doc/developer/design.md '\nSee `src/base/nowhere.f90`.'
planted 'bar.nml: doc/user/nowhere.md: no such file' input/bar.nml '! doc/user/nowhere.md'
planted 'kinds.f90: uses m_model of model, which is further up' src/base/kinds.f90 '   use m_model, only: model_t'
echo 'kinds.f90: imports model_t and does not use it' >>expected
mkdir tree/src/shelf
planted 'lonely.f90: shelf is no folder' src/shelf/lonely.f90 'module m_lonely\nend module m_lonely'
planted 'design.md: base does not name lonely' src/base/lonely.f90 'module m_lonely_too\nend module m_lonely_too'
planted 'gaps.f90: given: row of ASSOCIATE may have gaps, takes_three takes none' src/base/gaps.f90 "$(cat <<'END'
module m_gaps
contains
subroutine takes_three(x)
real, intent(in) :: x(3)
end subroutine
subroutine given(a, c)
real, intent(in) :: a(:, :)
real, intent(in), contiguous :: c(:, :)
associate (row => a(2, :), sum => a(1, :) + a(2, :), part => c(:3, 2))
call takes_three(row)
call takes_three(sum)
call takes_three(part)
call takes_three(row(:3) + 0.0)
end associate
end subroutine
end module
END
)"
echo 'design.md: base does not name gaps' >>expected
planted 'marks.f90: marked = marked .or. ...: an array of logicals' src/base/marks.f90 "$(cat <<'END'
module m_marks
contains
subroutine mark(marked, more, some)
logical, intent(inout) :: marked(:), some
logical, intent(in) :: more(:)
marked = marked .or. more
some = some .or. any(marked)
end subroutine
end module
END
)"
echo 'design.md: base does not name marks' >>expected
planted 'design.md: src/stepping/model.f90: no such file' doc/developer/design.md '\nSee `stepping/model.f90`.'
planted 'kinds.f90: .* lines, more than 450' src/base/kinds.f90 "$(yes '!' | head -450)"
planted 'kinds.f90: line .* has 118 columns' src/base/kinds.f90 "! $(printf 'word%.0s' $(seq 29))"
planted 'compare.py: line .* has 121 columns' test/harness/compare.py "\n# $(printf 'word %.0s' $(seq 23))tail"
planted "the README's scene" input/hertz.nml '&gravity acceleration=0,0,1 /'
if check tree >planted.log; then fail 'nothing planted was noticed'; fi
while read -r fault; do grep -q -- "$fault" planted.log || { cat planted.log; fail "not noticed: $fault"; }; done <expected
[ "$(wc -l <planted.log)" = "$(wc -l <expected)" ] || { cat planted.log; fail 'more was found than was planted'; }
echo "   $(wc -l <expected) planted faults noticed"
