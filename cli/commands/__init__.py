"""One module for each family of commands; `register` adds its commands to an application."""
