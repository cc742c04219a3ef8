"""What every part uses: checks of arguments, files, the machine, the style of pictures."""
