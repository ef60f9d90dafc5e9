/** New jobs that fit a robot to measured walks: the walk, the recordings, and the form of the job. */

import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { type Resource, useResource } from '../../api/resource'
import type { RecordingView } from '../../api/types'
import { ErrorNotice, Loading } from '../../components/feedback'
import { setQuery } from '../../router/navigation'
import { withQuery } from '../../router/routes'
import { type Catalogue, loadCatalogue } from '../catalogue'
import { ChosenCard } from './chosen-card'
import { words } from './fit'
import { IdentificationForm } from './identification'
import { UploadCard } from './upload-card'

type FitKind = 'identification'

const TITLES: Readonly<Record<FitKind, string>> = { identification: 'New identification' }

/** What the form of a kind needs. */
export interface FitProps {
  readonly catalogue: Catalogue
  readonly robot: string
  readonly onRobot: (name: string) => void
  /** Of the recordings that were chosen. */
  readonly ids: readonly string[]
  readonly recordings: Resource<readonly RecordingView[]>
}

export function FitPage({ kind, query }: { kind: FitKind; query: URLSearchParams }) {
  const catalogue = useResource('catalogue', loadCatalogue)
  const ids = unique(words(query.get('recordings') ?? ''))
  return (
    <>
      <header class="page-header">
        <div>
          <h1>{TITLES[kind]}</h1>
          <OtherKinds kind={kind} recordings={ids} />
        </div>
      </header>
      {catalogue.error && (
        <ErrorNotice
          what="The form cannot be filled in."
          error={catalogue.error}
          retry={catalogue.reload}
        />
      )}
      {catalogue.loading && <Loading what="the catalogue" />}
      {catalogue.data && <Fit catalogue={catalogue.data} ids={ids} />}
    </>
  )
}

function Fit({ catalogue, ids }: { catalogue: Catalogue; ids: readonly string[] }) {
  const usual = catalogue.fields.variant.get('name')?.default
  const [robot, setRobot] = useState(typeof usual === 'string' ? usual : catalogue.robots[0].name)
  const recordings = useResource(ids.length === 0 ? null : ids.join(), (signal) =>
    Promise.all(
      ids.map((id) =>
        get('/v1/recordings/{recording_id}/summary', { path: { recording_id: id }, signal }),
      ),
    ),
  )
  const choose = (chosen: readonly string[]) => {
    const text = unique(chosen).join(',')
    setQuery({ recordings: text === '' ? null : text })
  }
  const parts = { catalogue, robot, onRobot: setRobot, ids, recordings }
  return (
    <div class="stack">
      <UploadCard {...parts} onRead={({ recording }) => choose([...chosenNow(), recording.id])} />
      <ChosenCard ids={ids} recordings={recordings} onChange={choose} />
      {/* Nothing is fitted to nothing: what the job costs cannot be asked before. */}
      {ids.length > 0 && <IdentificationForm {...parts} />}
    </div>
  )
}

/** Links to the forms of other kinds of jobs; recordings that were chosen stay chosen. */
export function OtherKinds({
  kind,
  recordings = [],
}: {
  kind: FitKind | 'tuning'
  recordings?: readonly string[]
}) {
  const pathOf = (other: FitKind) =>
    withQuery('/jobs/new', { kind: other, recordings: recordings.join(',') })
  return (
    <p class="muted">
      or{' '}
      {kind === 'tuning' ? (
        <a href={pathOf('identification')}>an identification from measured walks</a>
      ) : (
        <a href="/jobs/new">a search for designs</a>
      )}
    </p>
  )
}

/** As the address says when an answer comes, which may have been asked for long before. */
function chosenNow(): string[] {
  return words(new URLSearchParams(location.search).get('recordings') ?? '')
}

function unique(ids: readonly string[]): string[] {
  return [...new Set(ids)]
}
