/** Job page: header, commands and tabs, updated live. */

import type { FunctionComponent } from 'preact'
import { useEffect, useState } from 'preact/hooks'
import { isReadable } from '../api/jobs'
import type { Job } from '../api/types'
import { Empty, ErrorNotice, Loading } from '../components/feedback'
import { capitalized } from '../format/words'
import { restoreJob } from '../jobs/deletion'
import { ALL_JOBS, Breadcrumbs, type Crumb } from '../router/breadcrumbs'
import { lazyPage } from '../router/lazy-page'
import { navigate, usePlace } from '../router/navigation'
import { jobPath, withQuery } from '../router/routes'
import { SHARED } from './designs/particles'
import { progressInWords } from './facts'
import { useGain } from './gain'
import { JobHeader } from './header/header'
import { type LiveJob, useJob } from './live/use-job'
import { ResultPanel } from './result/panel'
import './job.css'

export interface PanelProps {
  readonly live: LiveJob
  readonly job: Job
  readonly gain: ReturnType<typeof useGain>
  /** Part of the path after the section; undefined for none. */
  readonly detail: string | undefined
}

interface Section {
  readonly label: string
  /** Kinds of jobs that have it; all if empty. */
  readonly kinds: readonly Job['kind'][]
  readonly Panel: FunctionComponent<PanelProps>
}

function section(
  label: string,
  load: () => Promise<{ default: FunctionComponent<PanelProps> }>,
  ...kinds: Job['kind'][]
): Section {
  return { label, kinds, Panel: lazyPage(`the ${label.toLowerCase()}`, load) }
}

const FITS = ['identification', 'calibration'] as const

/** By name in the path. A certificate searches nothing and has no best world to show. */
const SECTIONS: Readonly<Record<string, Section>> = {
  '': { label: 'Result', kinds: [], Panel: ResultPanel },
  walk: section('Walk', () => import('./walk/panel'), 'tuning'),
  parameters: section('Parameters', () => import('./parameters/panel'), ...FITS),
  variables: section('Variables', () => import('./variables/panel')),
  'trade-offs': section('Trade-offs', () => import('./trade-offs/panel'), 'tuning'),
  preferences: section('What if', () => import('./preferences/panel'), 'tuning'),
  analysis: section('Importance', () => import('./analysis/panel'), 'tuning', ...FITS),
  robustness: section('Robustness', () => import('./robustness/panel'), 'tuning'),
  summary: section('Summary', () => import('./summary/panel')),
  iterations: section('Iterations', () => import('./iterations/panel')),
  activity: section('Activity', () => import('./activity/panel')),
  firmware: section('Firmware', () => import('./firmware/panel'), 'tuning'),
  reproduce: section('Spec and evidence', () => import('./reproduce/panel')),
}

const TABS: readonly (readonly [label: string, ...sections: string[]])[] = [
  ['Result', ''],
  ['Walk', 'walk'],
  ['Explore', 'parameters', 'variables', 'trade-offs', 'preferences', 'analysis'],
  ['Robustness', 'robustness'],
  ['Details', 'summary', 'iterations', 'activity', 'firmware', 'reproduce'],
]

/** Former sections that are parts of the result. */
const MOVED = ['overview', 'scenarios', 'targets', 'certificate', 'candidates']

function hasSection(job: Job, name: string): boolean {
  const kinds = SECTIONS[name]?.kinds
  return kinds?.length === 0 || kinds?.includes(job.kind) === true
}

export default function JobPage({ id, tab }: { id: string; tab: string }) {
  // Remount for another job, to reset all state.
  return <OneJob key={id} id={id} tab={tab} />
}

function OneJob({ id, tab }: { id: string; tab: string }) {
  const live = useJob(id)
  const { job, followed } = live
  const gain = useGain(job)
  useFormerAddress(id, tab)
  if (job === null) {
    return (
      <div class="stack">
        <Breadcrumbs crumbs={[ALL_JOBS]} here={`Job ${id}`} />
        {live.error === null ? (
          <Loading what="the job" />
        ) : live.missing ? (
          <section class="card">
            <Empty title="Job not found" level={1}>
              <p>
                Job {id} was deleted or belongs to another server. A deleted job can be restored for
                24 hours. Others are in the <a href="/jobs">list of jobs</a>.
              </p>
              <Restore id={id} />
            </Empty>
          </section>
        ) : (
          <>
            <h1>Job {id}</h1>
            <ErrorNotice what="Could not load the job." error={live.error} retry={live.reload} />
          </>
        )}
      </div>
    )
  }
  const name = job.name || job.id
  const [part, detail] = tab.split('/')
  const crumbs: Crumb[] = [ALL_JOBS]
  if (part !== '') crumbs.push([name, jobPath(job.id)])
  if (detail) crumbs.push([capitalized(part), jobPath(job.id, part)])
  const last = followed.iterations.at(-1)
  return (
    <div
      class="stack"
      data-iteration={last?.index ?? ''}
      data-best={last?.best_so_far ?? ''}
      data-stream={followed.connection}
    >
      <Breadcrumbs
        crumbs={crumbs}
        here={detail || (part !== '' && SECTIONS[part]?.label) || name}
        title={[name, progressInWords(job, followed.iterations)]}
      />
      <JobHeader live={live} job={job} />
      {isReadable(job) && !live.held && (
        <Sections live={live} job={job} part={part} detail={detail} gain={gain} />
      )}
    </div>
  )
}

/** A job is restored until 24 hours after its deletion. */
function Restore({ id }: { id: string }) {
  const [error, setError] = useState<unknown>(null)
  return (
    <>
      <button type="button" onClick={() => restoreJob(id).then(() => location.reload(), setError)}>
        Restore the deleted job
      </button>
      {error !== null && <ErrorNotice what="Could not restore the job." error={error} />}
    </>
  )
}

/** Replace an address of former tabs: `?tab=variables`, `/scenarios`. */
function useFormerAddress(id: string, tab: string): void {
  const { query } = usePlace()
  const requested = query.get('tab') ?? tab
  const isFormer = requested !== tab || MOVED.includes(tab)
  useEffect(() => {
    if (!isFormer) return
    const rest = Object.fromEntries([...query].filter(([name]) => name !== 'tab'))
    const part = MOVED.includes(requested) ? '' : requested
    navigate(withQuery(jobPath(id, part), rest), { replace: true })
  }, [isFormer])
}

function Sections({ part, ...props }: PanelProps & { part: string }) {
  const { job } = props
  const { query } = usePlace()
  const shared = Object.fromEntries(SHARED.map((name) => [name, query.get(name) ?? undefined]))
  const { Panel } = SECTIONS[part] ?? SECTIONS['']
  const link = (name: string, label: string, current: boolean) => (
    <a
      key={name}
      href={withQuery(jobPath(job.id, name), shared)}
      aria-current={current ? 'page' : undefined}
    >
      {label}
    </a>
  )
  const tabs = TABS.map(([label, ...names]) => ({
    label,
    names: names.filter((name) => hasSection(job, name)),
  })).filter(({ names }) => names.length > 0)
  const open = tabs.find(({ names }) => names.includes(part))
  return (
    <>
      <nav class="tabs" aria-label="Parts of the job">
        {tabs.map(({ label, names }) => link(names[0], label, names.includes(part)))}
      </nav>
      {open && open.names.length > 1 && (
        <nav class="sections" aria-label={open.label}>
          {open.names.map((name) => link(name, SECTIONS[name].label, name === part))}
        </nav>
      )}
      {open ? (
        <Panel {...props} />
      ) : (
        !MOVED.includes(part) && (
          <ErrorNotice what="Page not found." error="Choose one of the tabs above." />
        )
      )}
    </>
  )
}
