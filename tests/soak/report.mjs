/** What is said in the end: what was asked, what went wrong, what the process held. */
const FIGURES = ["memory, MiB", "… of its own", "… of files", "open files", "threads"];

/** Prints it; by how much memory grew, which is no number where it ended too soon. */
export function report({ tally, memory, metrics, ending }) {
  const kinds = [...tally.requests].toSorted(([, a], [, b]) => b - a);
  table(["asked and heard", "times"], [...kinds, ["all", tally.asks]]);
  const cache = (name) => new RegExp(`^belvedere_blob_cache_${name} (\\S+)`, "m").exec(metrics)?.[1] ?? "?";
  console.log(`objects from memory ${cache("hits_total")}, from the disk ${cache("misses_total")}\n`);

  for (const [words, times] of tally.errors) console.log(`wrong ${times} times: ${words}`);
  for (const line of [...ending.errors, ...ending.warnings].slice(0, 20)) console.log(`the log: ${line}`);
  const { errors, warnings, code } = ending;
  const logged = `${errors.length} errors and ${warnings.length} warnings in its log`;
  console.log(`${tally.wrongs} errors; the server ended with ${code}, ${logged}\n`);
  if (!memory.settled()) {
    console.log("it ended too soon to say whether memory grows");
    return Number.NaN;
  }

  const accounts = FIGURES.map((figure) => [figure, memory.account(figure)]);
  const rows = accounts.map(([figure, { first, last, worst, most, growth, perHour }]) => [
    figure,
    ...[first, last, worst, most].map((x) => x.toFixed(1)),
    `${(100 * growth).toFixed(1)} %`,
    perHour.toFixed(1),
  ]);
  table(["medians of minutes", "third", "last", "worst", "at most", "worst to third", "an hour"], rows);
  const [, { medians, growth }] = accounts[0];
  console.log(`memory minute by minute: ${medians.map((x) => x.toFixed(1)).join(" ")}`);
  return growth;
}

function table(head, rows) {
  const all = [head, ...rows].map((row) => row.map(String));
  const widths = head.map((_, i) => Math.max(...all.map((row) => row[i].length)));
  const line = (row) => row.map((text, i) => (i === 0 ? text.padEnd(widths[i]) : text.padStart(widths[i]))).join("  ");
  console.log(`${all.map(line).join("\n")}\n`);
}
