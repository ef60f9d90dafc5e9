/** New identification or calibration: measured log, recordings and form. */

import { useMemo, useState } from 'preact/hooks'
import { get, post } from '../../api/client'
import { type Resource, useResource } from '../../api/resource'
import type { RecordingView, RobotPreset, RobotSource } from '../../api/types'
import { Card, Loaded } from '../../components/card'
import { Combobox } from '../../components/fields/combobox'
import { RemovableList } from '../../components/fields/removable-list'
import { formatNumber } from '../../format/number'
import { ALL_JOBS, Breadcrumbs } from '../../router/breadcrumbs'
import { setQuery } from '../../router/navigation'
import { idsOf } from '../../router/query-value'
import { withQuery } from '../../router/routes'
import { type FieldErrors, robotOf } from '../draft/build-spec'
import { type Catalogue, loadCatalogue } from '../draft/catalogue'
import { emptyDraft, type RobotDraft } from '../draft/draft'
import { RobotSection } from '../robot/section'
import { CalibrationForm } from './calibration'
import { IdentificationForm } from './identification'
import { idsIn, recordingSearch, shortId } from './recordings/recording-search'
import { UploadCard } from './recordings/upload-card'
import { TargetTable } from './target-table'
import type { TableWalk } from './targets'

export type FitKind = 'identification' | 'calibration'

const TITLES: Readonly<Record<FitKind, string>> = {
  identification: 'New identification',
  calibration: 'New calibration',
}

const NO_ERRORS: FieldErrors = new Map()

const WORDS = {
  tuning: 'a search for designs',
  identification: 'an identification from measured walks',
  calibration: 'a calibration to measured walks',
}

type FittableParameters = Pick<RobotPreset, 'parameters' | 'conventions'>

export interface FitProps {
  readonly catalogue: Catalogue
  readonly robot: RobotSource
  readonly fittable: FittableParameters
  readonly ids: readonly string[]
}

export function FitPage({ kind, query }: { kind: FitKind; query: URLSearchParams }) {
  const catalogue = useResource('catalogue', loadCatalogue)
  const ids = idsOf(query.get('recordings'))
  return (
    <>
      <Breadcrumbs crumbs={[ALL_JOBS]} here={TITLES[kind]} />
      <header class="page-header">
        <div>
          <h1>{TITLES[kind]}</h1>
          <OtherKinds kind={kind} recordings={ids} />
        </div>
      </header>
      <Loaded resource={catalogue} what="the form">
        {(data) => <Fit kind={kind} catalogue={data} ids={ids} />}
      </Loaded>
    </>
  )
}

function Fit({
  kind,
  catalogue,
  ids,
}: {
  kind: FitKind
  catalogue: Catalogue
  ids: readonly string[]
}) {
  const [draft, setDraft] = useState(() => emptyDraft(catalogue))
  const [walks, setWalks] = useState<readonly TableWalk[]>([])
  const robot = useMemo(() => robotOf(draft) as RobotSource, [draft.robot])
  const fittable = useFittableParameters(draft.robot, catalogue)
  // The previous ones stay while others load, so that typed values are kept.
  const recordings = useResource(
    ids.length === 0 ? null : ids.join(),
    (signal) =>
      Promise.all(
        ids.map((id) =>
          get('/v1/recordings/{recording_id}/summary', { path: { recording_id: id }, signal }),
        ),
      ),
    { keep: true },
  )
  const select = (selected: readonly string[]) =>
    setQuery({ recordings: idsOf(selected.join()).join() || null })
  const parts = { catalogue, robot, fittable, ids }
  const shown = (recordings.data ?? []).filter(({ id }) => ids.includes(id))
  return (
    <div class="stack">
      <RobotSection
        draft={draft}
        catalogue={catalogue}
        errors={NO_ERRORS}
        onChange={(changes) => setDraft((old) => ({ ...old, ...changes }))}
      />
      <UploadCard {...parts} onRead={({ recording }) => select([...selectedNow(), recording.id])} />
      <RecordingsCard ids={ids} recordings={recordings} onChange={select} />
      {/* Without recordings, there is nothing to estimate. */}
      {ids.length > 0 && kind === 'identification' && <IdentificationForm {...parts} />}
      {kind === 'calibration' && <TargetTable onWalks={setWalks} />}
      {kind === 'calibration' && shown.length + walks.length > 0 && (
        <CalibrationForm {...parts} recordings={[...shown, ...walks]} />
      )}
    </div>
  )
}

export function OtherKinds({
  kind,
  recordings = [],
}: {
  kind: FitKind | 'tuning'
  recordings?: readonly string[]
}) {
  const others = (['tuning', 'identification', 'calibration'] as const).filter((k) => k !== kind)
  return (
    <p class="muted">
      {others.map((other) => (
        <span key={other}>
          or{' '}
          <a
            href={withQuery('/jobs/new', {
              kind: other === 'tuning' ? undefined : other,
              recordings: other === 'tuning' ? undefined : recordings.join(','),
            })}
          >
            {WORDS[other]}
          </a>{' '}
        </span>
      ))}
    </p>
  )
}

/** Selection in the address at this moment, which may have changed since the request. */
function selectedNow(): string[] {
  return idsOf(new URLSearchParams(location.search).get('recordings'))
}

/** Parameters from the catalogue, or from the check of a custom robot. */
function useFittableParameters(robot: RobotDraft, { robots }: Catalogue): FittableParameters {
  const isCustom = robot.kind === 'files' && robot.toml !== '' && robot.urdf !== ''
  const { toml, urdf } = robot
  const checked = useResource(isCustom ? `${toml} ${urdf}` : null, (signal) =>
    post('/v1/robots/checks', { body: { toml, urdf }, signal }),
  )
  const shipped = robots.find(({ name }) => name === robot.name) ?? robots[0]
  if (robot.kind !== 'files') return shipped
  return { parameters: checked.data?.parameters ?? [], conventions: shipped.conventions }
}

interface RecordingsCardProps {
  ids: readonly string[]
  recordings: Resource<readonly RecordingView[]>
  onChange: (ids: readonly string[]) => void
}

function RecordingsCard({ ids, recordings, onChange }: RecordingsCardProps) {
  return (
    <Card class="stack" title="Recordings to fit">
      {ids.length === 0 && (
        <p class="muted">None yet: upload a log above, or select a stored recording.</p>
      )}
      <Loaded resource={recordings} what="the recordings" />
      <RemovableList ids={ids} short={shortId} onChange={onChange}>
        {(id) => inWords(recordings.data?.find((recording) => recording.id === id))}
      </RemovableList>
      <div class="fields">
        <Combobox
          label="Stored recordings"
          placeholder="scenario, controller or id"
          remote={{ label: 'Recordings, newest first', search: recordingSearch(ids) }}
          hint="You can paste several ids at once."
          onChoose={(id) => onChange([...ids, id])}
          onPaste={(text) => {
            const pasted = idsIn(text).filter((id) => !ids.includes(id))
            if (pasted.length > 0) onChange([...ids, ...pasted])
            return pasted.length > 0
          }}
        />
      </div>
    </Card>
  )
}

function inWords(recording: RecordingView | undefined): string {
  if (!recording) return ''
  const { scenario, controller, seconds, mean_current, synthetic } = recording
  const length = `${formatNumber(seconds, 3)} s of ${scenario} with ${controller}`
  return `${length}, ${formatNumber(mean_current, 3)} A${synthetic ? ', synthetic' : ''}`
}
