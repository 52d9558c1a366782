/**
 * Runs whole studies through the types that openapi-typescript generates.
 *
 *     node study.js ADDRESS
 */
import { setTimeout as sleep } from "node:timers/promises";
import createClient from "openapi-fetch";
import type { components, paths } from "./schema.js";

type Schemas = components["schemas"];
type State = Schemas["StudyState"];
type Trial = Schemas["Trial"];
type Reply<T> = { data?: T; error?: { detail: string }; response: Response };

const TRIALS = 10;
const SECONDS = 60;
const FIGURE = "progress-gait-rmse-of-the-best-action-by-iteration";
const address = process.argv[2];
// The service runs without sign-in, so requests without a token have all rights. Scripts normally send a token.
const administrator = createClient<paths>({ baseUrl: address });
const client = createClient<paths>({ baseUrl: address });

/** The answer, or an exception with what the problem says. */
function given<T>(reply: Reply<T>): T {
  if (reply.data === undefined) throw new Error(reply.error?.detail ?? `${reply.response.status}`);
  return reply.data;
}

/** Throws where something does not hold. */
function check(holds: boolean, what: unknown): void {
  if (!holds) throw new Error(JSON.stringify(what));
}

/** What a 201 made, whose address is `path` and its identifier. */
function created<T extends { id: string }>(path: string, reply: Reply<T>): T {
  const made = given(reply);
  check(reply.response.status === 201, reply.response.status);
  const location = reply.response.headers.get("Location");
  check(location === `/api/v1/${path}/${made.id}`, location);
  return made;
}

/** Gait RMSE of a made-up walker, rad; undefined where it stumbles. */
function measure(bounds: Schemas["Bounds"]): number | undefined {
  if (bounds.a5 > 0.03 && bounds.a6 < 0.15) return undefined;
  return 0.1 + 3 * Math.abs(bounds.a5 - 0.026) + Math.abs(bounds.a6 - 0.3) / 2;
}

/** All trials in order, three at a time. */
async function trialsOf(id: string): Promise<Trial[]> {
  const trials: Trial[] = [];
  let cursor: string | undefined;
  do {
    const page = given(
      await client.GET("/api/v1/studies/{id}/trials", { params: { path: { id }, query: { limit: 3, cursor } } }),
    );
    trials.push(...page.items);
    cursor = page.next ?? undefined;
    check(cursor === undefined || page.items.length === 3, page);
  } while (cursor !== undefined);
  return trials.sort((one, other) => one.number - other.number);
}

/** Waits until the study has one of these states. */
async function waitUntil(id: string, ...states: State[]): Promise<State> {
  const end = Date.now() + SECONDS * 1000;
  for (;;) {
    const { state } = given(await client.GET("/api/v1/studies/{id}", { params: { path: { id } } }));
    if (states.includes(state)) return state;
    check(Date.now() < end, `the study is ${state}`);
    await sleep(50);
  }
}

/** A script evaluates every trial. */
async function byScript(subject_id: string): Promise<void> {
  const body = { subject_id, evaluation: "script" as const, number_of_trials: TRIALS };
  const { id } = created("studies", await client.POST("/api/v1/studies", { body }));
  for (;;) {
    const asked = await client.POST("/api/v1/studies/{id}/ask", {
      params: { path: { id } },
      body: { script: "treadmill" },
    });
    if (asked.response.status === 409) break;
    const trial = given(asked);
    const rmse = measure(trial.action);
    const told =
      rmse === undefined
        ? { label: "not_converged" as const, reason: "the walker stumbled" }
        : { label: "converged" as const, gait_rmse_rad: rmse };
    given(await client.POST("/api/v1/trials/{id}/tell", { params: { path: { id: trial.id } }, body: told }));
  }
  const numbers = (await trialsOf(id)).map((trial) => trial.number);
  check(numbers.length === TRIALS && numbers.every((number, place) => number === place + 1), numbers);
  await waitUntil(id, "finished");
  const history = given(await client.GET("/api/v1/studies/{id}/history", { params: { path: { id } } }));
  const best = history.items.at(-1);
  const rmse = best?.gait_rmse_rad?.toFixed(4);
  console.log(`typescript: ${numbers.length} trials, best: trial ${best?.number}, ${rmse} rad`);
}

/** A person answers the comparisons. */
async function byAPerson(subject_id: string): Promise<void> {
  const search_space: Schemas["SearchSpace"] = {
    dimensions: [
      { name: "a5", values: [0.013, 0.026], lengthscale: 0.013 },
      { name: "a6", values: [0.05, 0.1, 0.15, 0.2], lengthscale: 0.05 },
    ],
  };
  const body = { subject_id, search_space, answer_source: "people" as const, number_of_trials: 4 };
  const { id } = created("studies", await client.POST("/api/v1/studies", { body }));
  const params = { path: { id } };
  let compared = 1;
  while ((await waitUntil(id, "waiting", "finished")) === "waiting") {
    const trials = await trialsOf(id);
    const newest = trials.at(-1);
    if (newest === undefined || trials.length === compared) {
      await sleep(50);
      continue;
    }
    for (const trial of trials.slice(0, -1)) {
      const answer = (trial.gait_rmse_rad ?? NaN) < (newest.gait_rmse_rad ?? NaN) ? ("a" as const) : ("b" as const);
      const preference = { trial_a: trial.id, trial_b: newest.id, answer };
      const reply = await client.POST("/api/v1/studies/{id}/preferences", { params, body: preference });
      const said = created("preferences", reply);
      const row = given(await client.GET("/api/v1/preferences/{id}", { params: { path: { id: said.id } } }));
      check(row.seq === said.seq, row);
    }
    compared = trials.length;
  }
  const preferences = given(await client.GET("/api/v1/studies/{id}/preferences", { params }));
  check(preferences.items.length === 6, preferences);
  const best = given(await client.GET("/api/v1/studies/{id}/recommendation", { params }));
  const file = (ending: string) => ({ params: { path: { id, file: `${FIGURE}.${ending}` } } });
  const drawn = await client.GET("/api/v1/studies/{id}/figures/{file}", { ...file("png"), parseAs: "arrayBuffer" });
  check(drawn.response.headers.get("Content-Type") === "image/png", drawn.response.status);
  const picture = Buffer.from(given(drawn));
  check(picture.subarray(0, 8).toString("latin1") === "\x89PNG\r\n\x1a\n", picture.subarray(0, 8));
  const table = given(
    await client.GET("/api/v1/studies/{id}/figures/{file}", { ...file("csv"), parseAs: "text" }),
  );
  const kept = await administrator.GET("/api/v1/studies/{id}/archive", { params, parseAs: "arrayBuffer" });
  const archive = Buffer.from(given(kept));
  check(archive.subarray(0, 16).toString("latin1") === "gaitwright study", archive.subarray(0, 16));
  console.log(
    `typescript: recommends trial ${best.number}, ${picture.length} bytes of a picture, ` +
      `${table.trimEnd().split("\n").length} lines of a table, ${archive.length} bytes of an archive`,
  );
}

/** Gait RMSE answers the comparisons; a certificate is made on request. */
async function withAJob(subject_id: string): Promise<void> {
  const body = { subject_id, number_of_trials: TRIALS };
  const { id } = created("studies", await client.POST("/api/v1/studies", { body }));
  await waitUntil(id, "finished");
  let followed = 0;
  for (const trial of await trialsOf(id)) {
    if (trial.state !== "converged") continue;
    const params = { path: { id: trial.id } };
    const asked = await client.POST("/api/v1/trials/{id}/certificate", { params });
    let job: Schemas["Job"] = given(asked);
    if (asked.response.status === 200) {
      check(job.state === "done", job);
      continue;
    }
    check(asked.response.status === 202, asked.response.status);
    const location = asked.response.headers.get("Location");
    check(location === `/api/v1/jobs/${job.id}`, location);
    const end = Date.now() + SECONDS * 1000;
    while (job.state === "queued" || job.state === "running") {
      check(Date.now() < end, job);
      await sleep(50);
      job = given(await client.GET("/api/v1/jobs/{id}", { params: { path: { id: job.id } } }));
    }
    check(job.state === "done", job);
    check(job.result === `/api/v1/trials/${trial.id}/certificate`, job);
    given(await client.GET("/api/v1/trials/{id}/certificate", { params }));
    followed += 1;
  }
  check(followed > 0, "every gait had a certificate");
  console.log(`typescript: followed ${followed} jobs`);
}

const scopes: Schemas["NewToken"]["scopes"] = ["read", "run", "answer"];
const reply = await administrator.POST("/api/v1/tokens", { body: { name: "typescript", scopes } });
const { secret } = created("tokens", reply);
client.use({
  onRequest({ request }) {
    request.headers.set("Authorization", `Bearer ${secret}`);
  },
});
const body = { pseudonym: `typescript-${crypto.randomUUID().slice(0, 4)}`, height_m: 1.75, body_mass_kg: 70 };
const subject = created("subjects", await client.POST("/api/v1/subjects", { body }));
const read = given(await client.GET("/api/v1/subjects/{id}", { params: { path: { id: subject.id } } }));
check(JSON.stringify(read) === JSON.stringify(subject), read);
await byScript(subject.id);
await byAPerson(subject.id);
await withAJob(subject.id);
