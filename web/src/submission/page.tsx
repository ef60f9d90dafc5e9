/** New-job page, empty or prefilled from another job. */

import { get } from '../api/client'
import { readableJob } from '../api/jobs'
import { useResource } from '../api/resource'
import type { Job, JobSpec } from '../api/types'
import { Loaded } from '../components/card'
import { preferenceIn } from '../job/preference'
import { ALL_JOBS, Breadcrumbs, type Crumb } from '../router/breadcrumbs'
import { usePlace } from '../router/navigation'
import { idsOf } from '../router/query-value'
import { jobPath } from '../router/routes'
import { around, widened } from './draft/bounds'
import { type Catalogue, loadCatalogue, variablesOf } from './draft/catalogue'
import { type Draft, draftOf, emptyDraft, preferenceOf } from './draft/draft'
import { forgetDraft, keepDraft, keptDraft } from './draft/kept'
import { caseOf } from './draft/settings'
import { FitPage, OtherKinds } from './fit/page'
import { JobForm } from './form'
import { JsonForm } from './json-form'
import { ofKind } from './robot/job'
import './submission.css'

interface Start {
  readonly catalogue: Catalogue
  readonly draft: Draft
  readonly from: Job | null
  /** Whether the draft was begun earlier. */
  readonly kept: boolean
}

export default function NewJobPage() {
  const { query } = usePlace()
  const kind = query.get('kind')
  if (kind === 'identification' || kind === 'calibration') {
    return <FitPage kind={kind} query={query} />
  }
  return <NewTuning query={query} />
}

function NewTuning({ query }: { query: URLSearchParams }) {
  const start = useResource(`new ${query}`, (signal) => prepare(query, signal))
  const from = start.data?.from ?? null
  const above: readonly Crumb[] = from ? [[from.name || from.id, jobPath(from.id)]] : []
  return (
    <>
      <Breadcrumbs
        crumbs={[ALL_JOBS, ...above]}
        here="New job"
        title={[from ? `New job from ${from.name || from.id}` : 'New job']}
      />
      <header class="page-header">
        <div>
          <h1>New job</h1>
          {query.get('clone') === null && <OtherKinds kind="tuning" />}
          {from && (
            <p class="muted">
              from <a href={`/jobs/${from.id}`}>{from.name || from.id}</a>
            </p>
          )}
        </div>
      </header>
      <Loaded resource={start} what="the form">
        {({ catalogue, draft, kept }) =>
          from && isDocument(from, catalogue) ? (
            <JsonForm key={String(query)} spec={from.spec} />
          ) : (
            <>
              {kept && (
                <p class="row kept" role="status">
                  <span class="muted">Your draft was restored.</span>
                  <button
                    type="button"
                    class="compact"
                    onClick={() => {
                      forgetDraft()
                      start.reload()
                    }}
                  >
                    Start over
                  </button>
                </p>
              )}
              <JobForm
                key={`${query} ${kept}`}
                catalogue={catalogue}
                initial={draft}
                advanced={String(query) !== '' && query.get('robot') !== 'own'}
                onDraft={(changed) => from === null && keepDraft(changed)}
              />
            </>
          )
        }
      </Loaded>
    </>
  )
}

/**
 * Query parameters: `robot=own` starts with a URDF; `clone` is the id of a job, whose `seed` and
 * `preference` can be replaced; `scenarios` selects some of its scenarios; `widen` replaces bounds of
 * variables (`P:0:2`); `start` lists jobs whose best designs start the search; `iteration` and
 * `particle` select a design to search around.
 */
async function prepare(query: URLSearchParams, signal: AbortSignal): Promise<Start> {
  const id = query.get('clone')
  const [catalogue, cloned] = await Promise.all([
    loadCatalogue(signal),
    id === null ? null : readableJob(id, signal),
  ])
  const from = cloned && withSeed(tuningOf(cloned, query), query.get('seed'))
  if (!from || isDocument(from, catalogue)) {
    const kept = from === null && keptDraft()
    const draft = kept
      ? ownRobot({ ...emptyDraft(catalogue), ...kept }, catalogue, query)
      : blank(catalogue, query)
    return { catalogue, draft: startingFrom(draft, query), from, kept: Boolean(kept) }
  }
  let draft = startingFrom(draftOf(from.spec as JobSpec, catalogue), query)
  const preference = preferenceOf(preferenceIn(query), catalogue)
  if (preference) draft = { ...draft, preference }
  const widen = query.get('widen')
  if (widen !== null) draft = widened(draft, widen)
  const design = await designIn(query, from.id, signal)
  if (design) draft = around(draft, design, wholeVariables(catalogue, draft.controller))
  return { catalogue, draft, from, kept: false }
}

function blank(catalogue: Catalogue, query: URLSearchParams): Draft {
  return ownRobot(emptyDraft(catalogue), catalogue, query)
}

function ownRobot(draft: Draft, catalogue: Catalogue, query: URLSearchParams): Draft {
  return query.get('robot') === 'own' ? { ...draft, ...ofKind(draft, 'files', catalogue) } : draft
}

function startingFrom(draft: Draft, query: URLSearchParams): Draft {
  const jobs = idsOf(query.get('start'))
  return jobs.length === 0 ? draft : { ...draft, start: { ...draft.start, jobs } }
}

/** Whether the form cannot represent the job, because of its kind or an unknown plug-in case. */
function isDocument({ spec }: Job, { cases }: Catalogue): boolean {
  if (spec.kind !== 'tuning') return true
  return (spec.case ?? null) !== null && caseOf(spec.case, cases) === null
}

/** With a preference to tune by, a search for preferences is replaced by the job that it tunes. */
function tuningOf(job: Job, query: URLSearchParams): Job {
  if (job.spec.kind !== 'preferences' || !query.has('preference')) return job
  return { ...job, spec: job.spec.tuning as JobSpec }
}

function withSeed(job: Job, seed: string | null): Job {
  if (seed === null || !/^\d+$/.test(seed)) return job
  return { ...job, spec: { ...job.spec, seed: Number(seed) } }
}

async function designIn(query: URLSearchParams, job: string, signal: AbortSignal) {
  const [iteration, particle] = [query.get('iteration'), query.get('particle')]
  if (iteration === null || particle === null) return null
  const { items } = await get('/v1/jobs/{job_id}/iterations/{iteration}/evaluations', {
    path: { job_id: job, iteration: Number(iteration) },
    signal,
  })
  return items.find((evaluation) => evaluation.particle === Number(particle))?.design ?? null
}

function wholeVariables(catalogue: Catalogue, name: string): ReadonlySet<string> {
  const controller = catalogue.controllers.find((c) => c.name === name)
  return new Set(
    variablesOf(controller)
      .filter(({ kind }) => kind === 'integer')
      .map((v) => v.name),
  )
}
