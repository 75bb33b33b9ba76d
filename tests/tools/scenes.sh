# Sourced by other scripts. Prints where the test scenes are, which stand beside the repository. Without them it says so and
# prints nothing; but where the variable CI is set, all must be tested, and it fails. scenes.rs is the same for tests.

test_scenes() {
  local scenes=../shared/scenes
  if [ -d "$scenes" ]; then
    echo "$scenes"
  elif [ -n "${CI:-}" ]; then
    echo "there are no test scenes at $scenes" >&2
    return 1
  else
    echo "skipped: there are no test scenes at $scenes" >&2
  fi
}
