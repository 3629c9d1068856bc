# Installing.

##@ Install
.PHONY: install uninstall

PREFIX ?= /usr/local
INSTALL ?= install
installed_program = $(DESTDIR)$(PREFIX)/bin/gimp3d
installed_data = $(DESTDIR)$(PREFIX)/share/gimp3d

## install      to PREFIX=/usr/local; DESTDIR for packages
# gimp3d and gimp3d-post to PREFIX/bin (PREFIX=/usr/local), the Python package, scenes and documents to
# PREFIX/share/gimp3d; DESTDIR for packages
install: gimp3d
	$(INSTALL) -d $(dir $(installed_program))
	$(INSTALL) -m 755 $(program) $(installed_program)
	@for file in README.md CHANGELOG.md CITATION.cff LICENSE post/pyproject.toml post/gimp3d/*.py post/gimp3d/*.css post/gimp3d/*.js post/gimp3d/*.LICENSE \
	   post/gimp3d/identification/*.py post/gimp3d/identification/*.json \
	   $$(find doc input test/references tools/vumat -name '*.md' -o -name '*.inc' -o -name '*.INC' -o -name '*.f' -o -name '*.c' -o -name '*.png' -o -name '*.nml' -o -name '*.stl' -o -name '*.ipynb' -o -name '*.toml' -o -name '*.csv' -o -name '*.json'); do \
	   $(INSTALL) -d "$(installed_data)/$${file%/*}" && $(INSTALL) -m 644 "$$file" "$(installed_data)/$$file" || exit 1; done
	@printf '#!/bin/sh\nPYTHONPATH=%s exec "$${PYTHON:-python3}" -m gimp3d "$$@"\n' '$(PREFIX)/share/gimp3d/post$${PYTHONPATH:+:$$PYTHONPATH}' \
	   > $(installed_program)-post && chmod 755 $(installed_program)-post
	@echo "  install  $(installed_program), $(installed_program)-post, $(installed_data)"

### uninstall    remove what install put under PREFIX
uninstall:
	rm -f $(installed_program) $(installed_program)-post
	rm -rf $(installed_data)
