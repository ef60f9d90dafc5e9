/** Job page: header, commands and tabs, updated live. */

import { isReadable } from '../api/readable'
import type { Job, StoredJob } from '../api/types'
import { ErrorNotice, Loading } from '../components/feedback'
import { capitalized } from '../format/words'
import { ALL_JOBS, Breadcrumbs, type Crumb } from '../router/breadcrumbs'
import { lazyPart } from '../router/lazy-page'
import { usePlace } from '../router/navigation'
import { jobPath, withQuery } from '../router/routes'
import { caseWords } from './fitness'
import { type Gain, useGain } from './gain'
import { JobHeader } from './header/header'
import './job.css'
import { SHARED } from './designs/selection'
import { type LiveJob, useJob } from './live/use-job'
import { OverviewPanel } from './overview/panel'
import { progressInWords } from './state'

// Only the overview is part of the page's chunk.
const ActivityPanel = lazyPart('the activity', 'ActivityPanel', () => import('./activity/panel'))
const AnalysisPanel = lazyPart('the analysis', 'AnalysisPanel', () => import('./analysis/panel'))
const CertificatePanel = lazyPart(
  'the certificate',
  'CertificatePanel',
  () => import('./certificate/panel'),
)
const FirmwarePanel = lazyPart('the firmware', 'FirmwarePanel', () => import('./firmware/panel'))
const IterationPanel = lazyPart(
  'the iteration',
  'IterationPanel',
  () => import('./iterations/iteration-panel'),
)
const IterationsPanel = lazyPart(
  'the iterations',
  'IterationsPanel',
  () => import('./iterations/panel'),
)
const ParametersPanel = lazyPart(
  'the parameters',
  'ParametersPanel',
  () => import('./parameters/panel'),
)
const PreferencesPanel = lazyPart(
  'the preferences',
  'PreferencesPanel',
  () => import('./preferences/panel'),
)
const ReproducePanel = lazyPart('the spec', 'ReproducePanel', () => import('./reproduce/panel'))
const RobustnessPanel = lazyPart(
  'the robustness',
  'RobustnessPanel',
  () => import('./robustness/panel'),
)
const ScenariosPanel = lazyPart(
  'the scenarios',
  'ScenariosPanel',
  () => import('./scenarios/panel'),
)
const TargetsPanel = lazyPart('the targets', 'TargetsPanel', () => import('./targets/panel'))
const TradeOffsPanel = lazyPart(
  'the trade-offs',
  'TradeOffsPanel',
  () => import('./trade-offs/panel'),
)
const VariablesPanel = lazyPart(
  'the variables',
  'VariablesPanel',
  () => import('./variables/panel'),
)

const TABS = [
  { tab: '', label: 'Overview' },
  { tab: 'certificate', label: 'Certificate' },
  { tab: 'targets', label: 'Targets' },
  { tab: 'scenarios', label: 'Scenarios' },
  { tab: 'parameters', label: 'Parameters' },
  { tab: 'robustness', label: 'Robustness' },
  { tab: 'analysis', label: 'Analysis' },
  { tab: 'variables', label: 'Variables' },
  { tab: 'iterations', label: 'Iterations' },
  { tab: 'trade-offs', label: 'Trade-offs' },
  { tab: 'preferences', label: 'What if' },
  { tab: 'firmware', label: 'Firmware' },
  { tab: 'activity', label: 'Activity' },
  { tab: 'reproduce', label: 'Spec' },
] as const

/** Tabs that apply only to some kinds of jobs. */
const ONLY: Readonly<Partial<Record<string, readonly Job['kind'][]>>> = {
  certificate: ['certificate'],
  targets: ['calibration'],
  // A certificate has no best world to show by scenario.
  scenarios: ['tuning', 'identification', 'calibration'],
  parameters: ['identification', 'calibration'],
  robustness: ['tuning'],
  analysis: ['tuning', 'identification', 'calibration'],
  'trade-offs': ['tuning'],
  preferences: ['tuning'],
  firmware: ['tuning'],
}

function hasPart({ kind }: Job, tab: string): boolean {
  return ONLY[tab]?.includes(kind) ?? true
}

export default function JobPage({ id, tab }: { id: string; tab: string }) {
  // Remount for another job, to reset all state.
  return <OneJob key={id} id={id} tab={tab} />
}

function OneJob({ id, tab }: { id: string; tab: string }) {
  const live = useJob(id)
  const { job } = live
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
  return (
    <div
      class="stack"
      data-iteration={live.followed.iterations.at(-1)?.index ?? ''}
      data-best={live.followed.iterations.at(-1)?.best_so_far ?? ''}
      data-stream={streamState(live)}
    >
      <Breadcrumbs
        crumbs={crumbsOf(job, tab)}
        here={hereOf(job, tab)}
        title={[job.name || job.id, progressInWords(job, live.followed.iterations)]}
      />
      <JobHeader live={live} job={job} gain={gain} />
      {isReadable(job) && !live.held && <Parts live={live} job={job} tab={tab} gain={gain} />}
    </div>
  )
}

function crumbsOf(job: StoredJob, tab: string): readonly Crumb[] {
  const above: Crumb[] = [ALL_JOBS]
  if (tab !== '') above.push([job.name || job.id, jobPath(job.id)])
  const [section, inside] = tab.split('/')
  if (inside) above.push([capitalized(section), jobPath(job.id, section)])
  return above
}

function hereOf(job: StoredJob, tab: string): string {
  const [section, inside] = tab.split('/')
  if (inside) return inside
  const part = TABS.find((entry) => entry.tab === section)
  return section === '' || !part ? job.name || job.id : part.label
}

interface PartProps {
  readonly live: LiveJob
  readonly job: Job
  readonly tab: string
  readonly gain: Gain
}

function Parts({ live, job, tab, gain }: PartProps) {
  const tabs = TABS.filter(({ tab }) => hasPart(job, tab))
  const [section] = tab.split('/')
  const { query } = usePlace()
  const sharedQuery = Object.fromEntries(SHARED.map((name) => [name, query.get(name) ?? undefined]))
  return (
    <>
      <nav class="tabs" aria-label="Parts of the job">
        {tabs.map((t) => (
          <a
            key={t.tab}
            href={withQuery(jobPath(job.id, t.tab), sharedQuery)}
            aria-current={t.tab === section ? 'page' : undefined}
          >
            {t.tab === 'scenarios' ? capitalized(caseWords(job.kind).items) : t.label}
          </a>
        ))}
      </nav>
      <Panel live={live} job={job} tab={tab} gain={gain} />
    </>
  )
}

function Panel({ live, job, tab, gain }: PartProps) {
  const [section, detail] = tab.split('/')
  if (!hasPart(job, section)) return <NoSuchPart />
  switch (section) {
    case '':
      return <OverviewPanel live={live} job={job} reference={gain.reference} />
    case 'certificate':
      return <CertificatePanel job={job} />
    case 'targets':
      return <TargetsPanel job={job} />
    case 'scenarios':
      return <ScenariosPanel job={job} />
    case 'robustness':
      return <RobustnessPanel job={job} />
    case 'analysis':
      return <AnalysisPanel job={job} />
    case 'variables':
      return <VariablesPanel job={job} />
    case 'iterations':
      if (detail) return <IterationPanel job={job} index={Number(detail)} />
      return <IterationsPanel live={live} job={job} />
    case 'parameters':
      return <ParametersPanel job={job} />
    case 'trade-offs':
      return <TradeOffsPanel job={job} />
    case 'preferences':
      return <PreferencesPanel job={job} />
    case 'firmware':
      return <FirmwarePanel job={job} />
    case 'activity':
      return <ActivityPanel job={job} />
    case 'reproduce':
      return <ReproducePanel job={job} />
    default:
      return <NoSuchPart />
  }
}

function NoSuchPart() {
  return <ErrorNotice what="Page not found." error="Choose one of the tabs above." />
}

/** Connection state, read by tests. */
function streamState({ followed }: LiveJob): 'open' | 'stale' | 'ended' | 'connecting' {
  return followed.connection
}
