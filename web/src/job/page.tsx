/** Job page: header, commands and tabs, updated live. */

import type { FunctionComponent } from 'preact'
import { isReadable } from '../api/jobs'
import type { Job } from '../api/types'
import { ErrorNotice, Loading } from '../components/feedback'
import { capitalized } from '../format/words'
import { ALL_JOBS, Breadcrumbs, type Crumb } from '../router/breadcrumbs'
import { lazyPage } from '../router/lazy-page'
import { usePlace } from '../router/navigation'
import { jobPath, withQuery } from '../router/routes'
import { SHARED } from './designs/particles'
import { caseWords, progressInWords } from './facts'
import { useGain } from './gain'
import { JobHeader } from './header/header'
import { type LiveJob, useJob } from './live/use-job'
import { OverviewPanel } from './overview/panel'
import './job.css'

export interface PanelProps {
  readonly live: LiveJob
  readonly job: Job
  readonly gain: ReturnType<typeof useGain>
  /** Part of the path after the tab; undefined for none. */
  readonly detail: string | undefined
}

interface Part {
  readonly label: string
  /** Kinds of jobs that have it; all if empty. */
  readonly kinds: readonly Job['kind'][]
  readonly Panel: FunctionComponent<PanelProps>
}

function part(
  label: string,
  load: () => Promise<{ default: FunctionComponent<PanelProps> }>,
  ...kinds: Job['kind'][]
): Part {
  return { label, kinds, Panel: lazyPage(`the ${label.toLowerCase()}`, load) }
}

// A certificate has no best world to show by scenario, and searches nothing.
const SEARCHES = ['tuning', 'identification', 'calibration'] as const

const PARTS: Readonly<Record<string, Part>> = {
  '': { label: 'Overview', kinds: [], Panel: OverviewPanel },
  certificate: part('Certificate', () => import('./certificate/panel'), 'certificate'),
  candidates: part('Preferences', () => import('./candidates/panel'), 'preferences'),
  targets: part('Targets', () => import('./targets/panel'), 'calibration'),
  scenarios: part('Scenarios', () => import('./scenarios/panel'), ...SEARCHES),
  parameters: part(
    'Parameters',
    () => import('./parameters/panel'),
    'identification',
    'calibration',
  ),
  robustness: part('Robustness', () => import('./robustness/panel'), 'tuning'),
  analysis: part('Analysis', () => import('./analysis/panel'), ...SEARCHES),
  variables: part('Variables', () => import('./variables/panel')),
  iterations: part('Iterations', () => import('./iterations/panel')),
  'trade-offs': part('Trade-offs', () => import('./trade-offs/panel'), 'tuning'),
  preferences: part('What if', () => import('./preferences/panel'), 'tuning'),
  firmware: part('Firmware', () => import('./firmware/panel'), 'tuning'),
  activity: part('Activity', () => import('./activity/panel')),
  reproduce: part('Spec', () => import('./reproduce/panel')),
}

function hasPart(job: Job, tab: string): boolean {
  const kinds = PARTS[tab]?.kinds
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
  if (job === null) {
    return (
      <div class="stack">
        <Breadcrumbs crumbs={[ALL_JOBS]} here={`Job ${id}`} />
        {live.error === null ? (
          <Loading what="the job" />
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
  const [section, detail] = tab.split('/')
  const crumbs: Crumb[] = [ALL_JOBS]
  if (tab !== '') crumbs.push([name, jobPath(job.id)])
  if (detail) crumbs.push([capitalized(section), jobPath(job.id, section)])
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
        here={detail || (section !== '' && PARTS[section]?.label) || name}
        title={[name, progressInWords(job, followed.iterations)]}
      />
      <JobHeader live={live} job={job} gain={gain} />
      {isReadable(job) && !live.held && (
        <Parts live={live} job={job} section={section} detail={detail} gain={gain} />
      )}
    </div>
  )
}

function Parts({ section, ...props }: PanelProps & { section: string }) {
  const { job } = props
  const { query } = usePlace()
  const shared = Object.fromEntries(SHARED.map((name) => [name, query.get(name) ?? undefined]))
  const { Panel } = PARTS[section] ?? PARTS['']
  return (
    <>
      <nav class="tabs" aria-label="Parts of the job">
        {Object.entries(PARTS)
          .filter(([tab]) => hasPart(job, tab))
          .map(([tab, { label }]) => (
            <a
              key={tab}
              href={withQuery(jobPath(job.id, tab), shared)}
              aria-current={tab === section ? 'page' : undefined}
            >
              {tab === 'scenarios' ? capitalized(caseWords(job.kind).items) : label}
            </a>
          ))}
      </nav>
      {hasPart(job, section) ? (
        <Panel {...props} />
      ) : (
        <ErrorNotice what="Page not found." error="Choose one of the tabs above." />
      )}
    </>
  )
}
