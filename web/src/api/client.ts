/** Typed requests to the REST API. */

import { ApiProblem, problemOf } from './problem'
import type { paths } from './schema'

type Method = 'get' | 'post' | 'put' | 'patch' | 'delete'

export type PathOf<M extends Method> = {
  [P in keyof paths]: paths[P] extends Record<M, { responses: unknown }> ? P : never
}[keyof paths]

type Operation<P extends keyof paths, M extends Method> =
  paths[P] extends Record<M, infer O> ? O : never

type Json<R> = R extends { content: { 'application/json': infer B } } ? B : never

export type Answer<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { responses: infer R } ? Json<R[keyof R & (200 | 201 | 202)]> : never

export type Body<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { requestBody: { content: { 'application/json': infer B } } } ? B : never

type Query<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { parameters: { query?: infer Q } } ? Q : never

type Params<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { parameters: { path: infer V } } ? V : never

interface Options<P extends keyof paths, M extends Method> {
  readonly path?: Params<P, M>
  readonly query?: Query<P, M>
  readonly body?: Body<P, M>
  readonly headers?: Readonly<Record<string, string>>
  readonly signal?: AbortSignal
}

/** A function that sends requests of a method and returns the JSON of their responses. */
function jsonOf<M extends Method>(method: M) {
  return async <P extends PathOf<M>>(
    path: P,
    options: Options<P, M> = {},
  ): Promise<Answer<P, M>> => {
    const response = await send(method, path, options)
    return (response.status === 204 ? undefined : await response.json()) as Answer<P, M>
  }
}

/** GET a resource; `get('/v1/jobs/{job_id}', { path: { job_id } })`. */
export const get = jsonOf('get')
export const post = jsonOf('post')
export const put = jsonOf('put')
export const patch = jsonOf('patch')
export const remove = jsonOf('delete')

export async function getBytes<P extends PathOf<'get'>>(
  path: P,
  options: Options<P, 'get'> = {},
): Promise<ArrayBuffer> {
  return (await send('get', path, options)).arrayBuffer()
}

export async function postBytes<P extends PathOf<'post'>>(
  path: P,
  options: Options<P, 'post'> = {},
): Promise<ArrayBuffer> {
  return (await send('post', path, options)).arrayBuffer()
}

/** Fill in the path parameters and append the query; null values are left out, lists repeat the name. */
export function url(path: string, params?: unknown, query?: unknown): string {
  const values = (params ?? {}) as Record<string, unknown>
  const filled = path.replace(/\{(\w+)\}/g, (_, name: string) =>
    encodeURIComponent(String(values[name])),
  )
  const pairs = Object.entries(query ?? {}).flatMap(([name, value]) =>
    [value].flat().map((each) => [name, each] as const),
  )
  const set = pairs.filter(([, value]) => value !== undefined && value !== null)
  if (set.length === 0) return filled
  return `${filled}?${new URLSearchParams(set.map(([name, value]) => [name, String(value)]))}`
}

/** Throw ApiProblem for any response but a success; AbortError passes through. */
async function send<P extends keyof paths, M extends Method>(
  method: M,
  path: P,
  { path: params, query, body, headers, signal }: Options<P, M>,
): Promise<Response> {
  let response: Response
  try {
    response = await fetch(url(path, params, query), {
      method: method.toUpperCase(),
      headers: { ...headers, ...(body !== undefined && { 'Content-Type': 'application/json' }) },
      body: body === undefined ? undefined : JSON.stringify(body),
      signal,
    })
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') throw error
    throw new ApiProblem(0, 'cannot reach the server; is `gaitswarm serve` still running?')
  }
  if (response.ok) return response
  // The sign-in form reports a rejected token itself.
  if (response.status === 401 && path !== SESSION) for (const listener of unauthorized) listener()
  throw await problemOf(response)
}

const SESSION = '/v1/session'
const unauthorized = new Set<() => void>()

/** Subscribe to 401 responses; returns the unsubscribe function. */
export function onUnauthorized(listener: () => void): () => void {
  unauthorized.add(listener)
  return () => unauthorized.delete(listener)
}
