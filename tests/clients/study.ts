/**
 * Runs a whole study through the types that openapi-typescript generates.
 *
 *     node study.js ADDRESS
 */
import createClient from "openapi-fetch";
import type { components, paths } from "./schema.js";

type Trial = components["schemas"]["Trial"];

const BUDGET = 10;
const client = createClient<paths>({ baseUrl: process.argv[2] });

/** Gait RMSE of a made-up walker, rad; undefined where it stumbles. */
function measure(bounds: components["schemas"]["Bounds"]): number | undefined {
  if (bounds.a5 > 0.03 && bounds.a6 < 0.15) return undefined;
  return 0.1 + 3 * Math.abs(bounds.a5 - 0.026) + Math.abs(bounds.a6 - 0.3) / 2;
}

/** The answer, or an exception with what the problem says. */
function given<T>(reply: { data?: T; error?: { detail: string } }): T {
  if (reply.data === undefined) throw new Error(reply.error?.detail ?? "no answer");
  return reply.data;
}

const subjects = given(await client.GET("/api/v1/subjects"));
const subject = subjects.items.find((one) => one.pseudonym === "paper-1");
if (!subject) throw new Error("there is no subject paper-1");
const body = { subject_id: subject.id, name: "typescript", evaluation: "script" as const, trial_budget: BUDGET };
const study = given(await client.POST("/api/v1/studies", { body }));
const id = study.id;
for (;;) {
  const asked = await client.POST("/api/v1/studies/{id}/ask", { params: { path: { id } }, body: { worker: "treadmill" } });
  if (asked.response.status === 409) break;
  const trial = given(asked);
  const rmse = measure(trial.action);
  const told =
    rmse === undefined
      ? { outcome: "not_converged" as const, reason: "the walker stumbled" }
      : { outcome: "converged" as const, gait_rmse_rad: rmse };
  given(await client.POST("/api/v1/trials/{id}/tell", { params: { path: { id: trial.id } }, body: told }));
}
const trials: Trial[] = [];
let cursor: string | undefined;
do {
  const page = given(
    await client.GET("/api/v1/studies/{id}/trials", { params: { path: { id }, query: { limit: 3, cursor } } }),
  );
  trials.push(...page.items);
  cursor = page.next ?? undefined;
} while (cursor !== undefined);
if (trials.length !== BUDGET) throw new Error(`${trials.length} trials`);
const history = given(await client.GET("/api/v1/studies/{id}/history", { params: { path: { id } } }));
const ended = given(await client.GET("/api/v1/studies/{id}", { params: { path: { id } } }));
if (ended.state !== "finished") throw new Error(ended.state);
const best = history.items.at(-1);
console.log(`typescript: ${trials.length} trials, best: trial ${best?.number}, ${best?.gait_rmse_rad?.toFixed(4)} rad`);
